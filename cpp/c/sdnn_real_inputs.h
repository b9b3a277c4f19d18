/* A number in [0, 1]. */
static inline sdnn_real sdnn_in_unit(sdnn_real x) {
  return !sdnn_less(0, x) ? 0 : sdnn_less(SDNN_ONE, x) ? SDNN_ONE : x;
}

/* The position of a reading in its range, at most a width outside. */
static inline sdnn_real sdnn_position(sdnn_real reading, sdnn_real low, sdnn_real width) {
  return sdnn_between(sdnn_over(sdnn_minus(reading, low), width), SDNN_ONE | SDNN_MINUS, SDNN_TWO);
}
static inline sdnn_real sdnn_part_of_turns(sdnn_real turns) {
  return sdnn_minus(turns, sdnn_floor(turns));
}
static inline sdnn_real sdnn_direction(sdnn_real cosine, sdnn_real sine) {
  return sdnn_over(sdnn_plus(sdnn_atan2(sine, cosine), SDNN_PI), SDNN_TWO_PI);
}
static inline sdnn_real sdnn_middle_of_symbol(uint32_t symbol, uint32_t n) {
  return sdnn_over(sdnn_real_of(2 * (int64_t)symbol + 1, -1), sdnn_real_of(n, 0));
}

/* How an input is computed from readings, which SDNN_READING(i) has as real numbers. */
#define SDNN_VARIABLE(i, at, low, width) \
  inputs[i] = SDNN_HELD(SDNN_LACKS(at), SDNN_HALF, sdnn_position(SDNN_READING(at), low, width));
#define SDNN_CIRCULAR(i, at, low, width)           \
  inputs[i] = SDNN_HELD(SDNN_LACKS(at), SDNN_HALF, \
                        sdnn_part_of_turns(sdnn_over(sdnn_minus(SDNN_READING(at), low), width)));
#define SDNN_ANGLE(i, cosine, sine)                                                  \
  inputs[i] = sdnn_direction(SDNN_HELD(SDNN_LACKS(cosine), 0, SDNN_READING(cosine)), \
                             SDNN_HELD(SDNN_LACKS(sine), 0, SDNN_READING(sine)));
#define SDNN_SYMBOL(i, at, n)                                                         \
  {                                                                                   \
    uint32_t k, symbol = 0;                                                           \
    for (k = 1; k < n; ++k) {                                                         \
      if (sdnn_less(SDNN_READING((at) + symbol), SDNN_READING((at) + k))) symbol = k; \
    }                                                                                 \
    inputs[i] = sdnn_middle_of_symbol(symbol, n);                                     \
  }
