/* An estimator's predictions as numbers of C. The file that includes this one defines
 *
 *   SDNN_MODEL_PARAMETER, SDNN_MODEL    the parameter `model` of functions with a comma, and its
 *                                       argument; nothing where weights are constants
 *   SDNN_RANGES                         the ranges of a regressor's outputs
 *   sdnn_predicted_totals(..., x, totals)
 *                                       writes the totals for a sample; returns whether every value
 *                                       has a bin */
#ifndef SDNN_PREDICTIONS_H
#define SDNN_PREDICTIONS_H

#include "sdnn_estimates.h"

#if !SDNN_IS_CLASSIFIER

/* Writes the outputs of a sample. Returns 0, and writes nothing, for a sample that is refused: with
 * infinity, an unknown category or a missing value for which the estimator has no pattern. */
static inline int sdnn_predict(SDNN_MODEL_PARAMETER const double* x, double* y) {
  sdnn_total totals[SDNN_N_GROUPS];
  uint32_t i;
  if (!sdnn_predicted_totals(SDNN_MODEL x, totals)) return 0;
  for (i = 0; i < SDNN_N_GROUPS; ++i) {
    y[i] = sdnn_double_of(sdnn_output(SDNN_RANGES + 2 * i, totals[i]));
  }
  return 1;
}

#else

/* The number of a sample's class, or -1 for a sample that is refused: with infinity, an unknown
 * category or a missing value for which the estimator has no pattern. */
static inline int32_t sdnn_predict(SDNN_MODEL_PARAMETER const double* x) {
  sdnn_total totals[SDNN_N_GROUPS];
  return sdnn_predicted_totals(SDNN_MODEL x, totals) ? sdnn_class_of(totals) : -1;
}

/* Writes the scores of the classes. Returns 0, and writes nothing, for a sample that is refused. */
static inline int sdnn_scores(SDNN_MODEL_PARAMETER const double* x, double* scores) {
  sdnn_total totals[SDNN_N_GROUPS];
  sdnn_real bits[SDNN_N_CLASSES];
  uint32_t i;
  if (!sdnn_predicted_totals(SDNN_MODEL x, totals)) return 0;
  sdnn_scores_of(totals, bits);
  for (i = 0; i < SDNN_N_CLASSES; ++i) scores[i] = sdnn_double_of(bits[i]);
  return 1;
}

#endif

#endif /* SDNN_PREDICTIONS_H */
