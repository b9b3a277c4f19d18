/* A kernel estimator that predicts: sums of a kernel of the sample and samples that were learned.
 */
#ifndef SDNN_KERNEL_ESTIMATOR_H
#define SDNN_KERNEL_ESTIMATOR_H

#include "sdnn_coded_inputs.h"

#if SDNN_BINS_ARE_BYTES
typedef uint8_t sdnn_bin;
#else
typedef uint16_t sdnn_bin;
#endif

/* The correlations of the bins of an input: by distance, or row by row. */
typedef struct {
  uint32_t first; /* in sdnn_correlations */
  uint32_t by_distance;
} sdnn_correlation;

static const sdnn_correlation sdnn_correlation_of[SDNN_N_INPUTS] = {SDNN_CORRELATION_OF};

/* The correlation of the patterns of two bins of an input. Bin n stands for a missing value. */
static inline sdnn_real sdnn_rho(uint32_t input, uint32_t a, uint32_t b) {
  const sdnn_correlation* const correlation = &sdnn_correlation_of[input];
  const uint32_t n = sdnn_inputs[input].n_bins;
  const sdnn_real* const values = sdnn_correlations + correlation->first;
  if (a == n || b == n) return a == b ? SDNN_ONE : 0; /* missing values */
  if (correlation->by_distance) return values[a < b ? b - a : a - b];
  return values[a * n + b];
}

/* The kernel of a sample and a component, with the operations of the library in their order. */
static inline sdnn_real sdnn_kernel(const uint32_t* bins, const sdnn_bin* component) {
  const sdnn_real half = sdnn_real_of(1, -1);
  sdnn_real total = 0;
  uint32_t i;
#if SDNN_HAS_ALL_PAIRS
  sdnn_real squares = 0;
  for (i = 0; i < SDNN_N_INPUTS; ++i) {
    const sdnn_real rho = sdnn_rho(i, bins[i], component[i]);
    total = sdnn_plus(total, rho);
    squares = sdnn_plus(squares, sdnn_times(rho, rho));
  }
  total =
      sdnn_plus(sdnn_times(sdnn_real_of(SDNN_N_INPUTS - 1, 0), total), sdnn_times(total, total));
  total = sdnn_minus(total, squares);
#else
  for (i = 0; i < SDNN_N_PAIRS; ++i) {
    const uint32_t mu = sdnn_pairs[i][0], nu = sdnn_pairs[i][1];
    sdnn_real rho = sdnn_rho(mu, bins[mu], component[mu]);
    if (mu == nu) {
      rho = sdnn_plus(rho, rho);
    } else {
      const sdnn_real by = sdnn_plus(SDNN_ONE, sdnn_rho(nu, bins[nu], component[nu]));
      rho = sdnn_times(sdnn_times(by, half), rho);
    }
    total = sdnn_plus(total, rho);
  }
#endif
  total = sdnn_over(total, sdnn_real_of(SDNN_KERNEL_DIVISOR, 0));
  if (SDNN_DEGREE == 2) return sdnn_times(total, sdnn_plus(half, sdnn_times(half, total)));
  if (SDNN_DEGREE == 3) return sdnn_times(total, sdnn_times(total, total));
  return total;
}

#if SDNN_N_DIRECTIONS > 0
/* Writes mixtures of features, after them. Returns whether these are finite. */
static inline int sdnn_mix(double* x) {
  sdnn_real sums[SDNN_N_DIRECTIONS];
  uint32_t d, i;
  for (d = 0; d < SDNN_N_DIRECTIONS; ++d) sums[d] = 0;
  for (i = 0; i < SDNN_N_MIXED; ++i) {
    const sdnn_real value = sdnn_bits_of(x[sdnn_mixed[i]]);
    sdnn_real position;
    if ((value & ~SDNN_MINUS) >= SDNN_INFINITY) return 0;
    position = sdnn_even_position(sdnn_mixed_values + 4 * i, value);
    for (d = 0; d < SDNN_N_DIRECTIONS; ++d) {
      const sdnn_real weight = sdnn_directions[i * SDNN_N_DIRECTIONS + d];
      sums[d] = sdnn_plus(sums[d], sdnn_times(weight, position));
    }
  }
  for (d = 0; d < SDNN_N_DIRECTIONS; ++d) x[SDNN_N_FEATURES + d] = sdnn_double_of(sums[d]);
  return 1;
}
#endif

/* The outputs of a sample, summed over the components in their order. Returns whether every value
 * has a bin. */
static inline int sdnn_outputs_of(const double* x, sdnn_real* outputs) {
  uint32_t bins[SDNN_N_INPUTS], j, k;
#if SDNN_N_DIRECTIONS > 0
  double values[(uint32_t)SDNN_N_FEATURES + SDNN_N_DIRECTIONS];
  for (j = 0; j < SDNN_N_FEATURES; ++j) values[j] = x[j];
  if (!sdnn_mix(values) || !sdnn_bins_of(values, bins)) return 0;
#else
  if (!sdnn_bins_of(x, bins)) return 0;
#endif
  for (k = 0; k < SDNN_N_SUMS; ++k) outputs[k] = 0;
  for (j = 0; j < SDNN_N_COMPONENTS; ++j) {
    const sdnn_real kernel = sdnn_kernel(bins, sdnn_components + j * SDNN_N_INPUTS);
    for (k = 0; k < SDNN_N_SUMS; ++k) {
      const sdnn_real dual = sdnn_duals[j * SDNN_N_SUMS + k];
      outputs[k] = sdnn_plus(outputs[k], sdnn_times(kernel, dual));
    }
  }
  for (k = 0; k < SDNN_N_SUMS; ++k) outputs[k] = sdnn_plus(outputs[k], sdnn_intercepts[k]);
  return 1;
}

/* Writes the outputs of a sample, or the scores of the classes. Returns 0, and writes nothing, for
 * a sample that is refused: with infinity, an unknown category or a missing value for which the
 * estimator has no pattern. */
#if SDNN_IS_CLASSIFIER
static inline int sdnn_scores(const double* x, double* y) {
#else
static inline int sdnn_predict(const double* x, double* y) {
#endif
  sdnn_real outputs[SDNN_N_SUMS];
  uint32_t k;
  if (!sdnn_outputs_of(x, outputs)) return 0;
  for (k = 0; k < SDNN_N_SUMS; ++k) y[k] = sdnn_double_of(outputs[k]);
  return 1;
}

#if SDNN_IS_CLASSIFIER
/* The number of a sample's class, or -1 for a sample that is refused. */
static inline int32_t sdnn_predict(const double* x) {
  sdnn_real scores[SDNN_N_CLASSES];
  uint32_t i, best = 0;
  if (!sdnn_outputs_of(x, scores)) return -1;
  for (i = 1; i < SDNN_N_CLASSES; ++i) {
    if (sdnn_less(scores[best], scores[i])) best = i;
  }
  return (int32_t)best;
}
#endif

#endif /* SDNN_KERNEL_ESTIMATOR_H */
