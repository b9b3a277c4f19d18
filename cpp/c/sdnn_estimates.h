/* An estimator's predictions, from the totals of its groups of units.
 *
 * A group has SDNN_GROUP_SIZE units. Its total is the number of units that fire, or with one unit
 * its potential, summed over SDNN_N_NETWORKS networks. */
#ifndef SDNN_ESTIMATES_H
#define SDNN_ESTIMATES_H

#include "sdnn_real.h"

#if SDNN_GROUP_SIZE > 1 || !SDNN_IS_CLASSIFIER
typedef int32_t sdnn_total;
#define SDNN_COUNTS_UNITS 1
#else
typedef int64_t sdnn_total;
#define SDNN_COUNTS_UNITS 0
#endif

/* The mean of a total over the networks. */
static inline sdnn_real sdnn_mean(sdnn_total total) {
  const sdnn_real sum = sdnn_real_of(total, 0);
  return SDNN_N_NETWORKS == 1 ? sum : sdnn_over(sum, sdnn_real_of(SDNN_N_NETWORKS, 0));
}

#if !SDNN_IS_CLASSIFIER

/* The change of an output for each firing unit; `range` has its lowest and highest value. */
static inline sdnn_real sdnn_step(const sdnn_real* range) {
  return sdnn_over(sdnn_minus(range[1], range[0]), sdnn_real_of(SDNN_COUNTS_OF_RANGE, 0));
}

/* The output that a total stands for. */
static inline sdnn_real sdnn_output(const sdnn_real* range, sdnn_total total) {
  return sdnn_plus(sdnn_times(sdnn_step(range), sdnn_mean(total)), range[0]);
}

#else

#if SDNN_IS_ONE_VS_ONE
/* Writes the score of each class: its votes, plus s / (3 (|s| + 1)) of the sum s of its margins,
 * which breaks ties as scikit-learn's one-versus-one classifiers do. A pair's unit, with a margin
 * above 0, votes for the first class, else for the second. */
static inline void sdnn_scores_of(const sdnn_total* totals, sdnn_real* scores) {
  const sdnn_real half = sdnn_real_of(1, -1);
  sdnn_real sums[SDNN_N_CLASSES];
  uint32_t votes[SDNN_N_CLASSES];
  uint32_t i, j, unit = 0;
  for (i = 0; i < SDNN_N_CLASSES; ++i) sums[i] = votes[i] = 0;
  for (i = 0; i < SDNN_N_CLASSES; ++i) {
    for (j = i + 1; j < SDNN_N_CLASSES; ++j, ++unit) {
      const sdnn_real margin = sdnn_minus(sdnn_mean(totals[unit]), half);
      sums[i] = sdnn_plus(sums[i], margin);
      sums[j] = sdnn_minus(sums[j], margin);
      ++votes[sdnn_less(0, margin) ? i : j];
    }
  }
  for (i = 0; i < SDNN_N_CLASSES; ++i) {
    sdnn_real share = sums[i] & ~SDNN_MINUS;
    share = sdnn_times(sdnn_real_of(3, 0), sdnn_plus(share, SDNN_ONE));
    scores[i] = sdnn_plus(sdnn_real_of(votes[i], 0), sdnn_over(sums[i], share));
  }
#if SDNN_N_CLASSES == 2
  scores[0] = sdnn_minus(sdnn_mean(totals[0]), half);
  scores[1] = scores[0] ^ SDNN_MINUS;
#endif
}
#else
/* Writes the score of each class: the part of its units that fire, or the potential of its unit. */
static inline void sdnn_scores_of(const sdnn_total* totals, sdnn_real* scores) {
  uint32_t i;
  for (i = 0; i < SDNN_N_CLASSES; ++i) {
    scores[i] = sdnn_mean(totals[i]);
#if SDNN_COUNTS_UNITS
    scores[i] = sdnn_over(scores[i], sdnn_real_of(SDNN_GROUP_SIZE, 0));
#endif
  }
}
#endif

/* The number of the class with the largest score, the first of several. */
static inline int32_t sdnn_class_of(const sdnn_total* totals) {
  sdnn_real scores[SDNN_N_CLASSES];
  uint32_t i, best = 0;
  sdnn_scores_of(totals, scores);
  for (i = 1; i < SDNN_N_CLASSES; ++i) {
    if (sdnn_less(scores[best], scores[i])) best = i;
  }
  return (int32_t)best;
}

#endif

#endif /* SDNN_ESTIMATES_H */
