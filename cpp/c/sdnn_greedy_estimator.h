/* An estimator that predicts: its weights are constants. */
#ifndef SDNN_GREEDY_ESTIMATOR_H
#define SDNN_GREEDY_ESTIMATOR_H

#include "sdnn_estimates.h"
#include "sdnn_input_pairs.h"
#include "sdnn_weight_bytes.h"

/* The excess of a weight that does not fit a byte, beyond its byte: the weight of a unit for the
 * column of a pair and a unit of its pattern. */
typedef struct {
  uint16_t unit;
  uint16_t pair;
  uint16_t pattern_unit;
  int16_t excess;
} sdnn_excess;

typedef struct {
  const uint32_t* weights; /* of four units each: high bytes if there are any, then low bytes */
  const int32_t* thresholds;
  const uint8_t* n_bytes; /* of a weight, for four units each */
  uint32_t first_excess;  /* in sdnn_excesses, in the order of units */
  uint32_t n_excesses;
} sdnn_network;

#if SDNN_HAS_EXCESSES
static const sdnn_excess sdnn_excesses[] = {SDNN_EXCESSES};
#endif

static const sdnn_network sdnn_networks[SDNN_N_NETWORKS] = {SDNN_NETWORKS};

/* Adds the totals of a network. */
static inline void sdnn_add_totals(const sdnn_network* network, const uint32_t* bins,
                                   const sdnn_code* code, sdnn_total* totals) {
  const sdnn_column* const negative = code->columns + SDNN_MOST_COLUMNS - code->n_negative;
#if SDNN_HAS_EXCESSES
  const sdnn_excess* excess = sdnn_excesses + network->first_excess;
  const sdnn_excess* const end = excess + network->n_excesses;
#endif
  const uint32_t* weights = network->weights;
  uint32_t unit, byte, i, left = SDNN_GROUP_SIZE;
  for (unit = 0; unit < SDNN_N_UNITS; unit += 4) {
    uint32_t potentials[4] = {0, 0, 0, 0};
    for (byte = network->n_bytes[unit >> 2]; byte-- > 0; weights += SDNN_N_COLUMNS) {
      for (i = 0; i < 4; ++i) potentials[i] <<= 8;
      sdnn_add_signed(weights, code->columns, code->n_positive, negative, code->n_negative,
                      potentials);
    }
#if SDNN_HAS_EXCESSES
    for (; excess < end && excess->unit < unit + 4; ++excess) {
      const int32_t sign = sdnn_sign_of(bins, &sdnn_pairs[excess->pair], excess->pattern_unit);
      potentials[excess->unit - unit] += (uint32_t)(sign * excess->excess);
    }
#else
    (void)bins;
#endif
    for (i = 0; i < 4 && unit + i < SDNN_N_UNITS; ++i) {
      const uint32_t potential = potentials[i] - (uint32_t)network->thresholds[unit + i];
#if SDNN_COUNTS_UNITS
      *totals += potential - 1 < UINT32_C(0x7fffffff); /* above zero, as a number with a sign */
#else
      *totals += potential >> 31 ? -(int64_t)(0 - potential) : (int64_t)potential;
#endif
      if (--left == 0) {
        left = SDNN_GROUP_SIZE;
        ++totals;
      }
    }
  }
}

/* Writes the totals for a sample. Returns whether every value has a bin. */
static inline int sdnn_predicted_totals(const double* x, sdnn_total* totals) {
  uint32_t bins[SDNN_N_INPUTS], i;
  sdnn_code code;
  if (!sdnn_bins_of(x, bins)) return 0;
  sdnn_encode(bins, &code);
  for (i = 0; i < SDNN_N_GROUPS; ++i) totals[i] = 0;
  for (i = 0; i < SDNN_N_NETWORKS; ++i) sdnn_add_totals(&sdnn_networks[i], bins, &code, totals);
  return 1;
}

#define SDNN_MODEL_PARAMETER
#define SDNN_MODEL
#define SDNN_RANGES sdnn_ranges
#include "sdnn_predictions.h"

#endif /* SDNN_GREEDY_ESTIMATOR_H */
