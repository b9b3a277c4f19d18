/* The bins of a state's numbers in [0, 1]. */
static inline void sdnn_bins_of_state(const sdnn_real* state, uint32_t* bins) {
  uint32_t i;
  for (i = 0; i < SDNN_N_INPUTS; ++i) {
    const uint32_t n = sdnn_n_bins[i];
    const uint32_t bin = (uint32_t)sdnn_whole(sdnn_times(state[i], sdnn_real_of(n, 0)));
    bins[i] = bin < n ? bin : n - 1;
  }
}
