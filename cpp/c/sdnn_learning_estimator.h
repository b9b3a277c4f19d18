/* An estimator that learns one sample after the other: its weights are in a struct. */
#ifndef SDNN_LEARNING_ESTIMATOR_H
#define SDNN_LEARNING_ESTIMATOR_H

#include "sdnn_estimates.h"
#include "sdnn_input_pairs.h"

#define SDNN_MOST_WEIGHT 32767
#define SDNN_MOST_THRESHOLD (INT32_C(1) << 30)

/* All that an estimator remembers, without pointers: a copy of the bytes is the same estimator. */
typedef struct {
#if !SDNN_IS_CLASSIFIER
  sdnn_real ranges[UINT32_C(2) * SDNN_N_OUTPUTS]; /* lowest and highest outputs */
#endif
  int32_t thresholds[SDNN_N_UNITS];
  int16_t weights[(uint32_t)SDNN_N_COLUMNS * SDNN_N_UNITS]; /* column by column */
  int16_t largest[SDNN_N_UNITS]; /* no weight of a unit has a larger absolute value */
} sdnn_model;

/* The units that a sample corrects: of unit units[k] in the direction +1 or -1, directions[k]. */
typedef struct {
  uint32_t n;
  uint16_t units[SDNN_N_UNITS];
  int8_t directions[SDNN_N_UNITS];
} sdnn_corrections;

/* The largest absolute value of a unit's weights. */
static inline int16_t sdnn_largest_weight(const sdnn_model* model, uint32_t unit) {
  const int16_t* weight = model->weights + unit;
  int32_t largest = 0;
  uint32_t column;
  for (column = 0; column < SDNN_N_COLUMNS; ++column, weight += SDNN_N_UNITS) {
    const int32_t size = *weight < 0 ? -*weight : *weight;
    if (size > largest) largest = size;
  }
  return (int16_t)largest;
}

/* Begins with the weights, thresholds and ranges that the exporter wrote. */
static inline void sdnn_begin(sdnn_model* model) {
  uint32_t i;
  for (i = 0; i < (uint32_t)SDNN_N_COLUMNS * SDNN_N_UNITS; ++i) {
    model->weights[i] = sdnn_first_weights[i];
  }
  for (i = 0; i < SDNN_N_UNITS; ++i) {
    model->thresholds[i] = sdnn_first_thresholds[i];
    model->largest[i] = sdnn_largest_weight(model, i);
  }
#if !SDNN_IS_CLASSIFIER
  for (i = 0; i < UINT32_C(2) * SDNN_N_OUTPUTS; ++i) model->ranges[i] = sdnn_ranges[i];
#endif
}

/* Sums each unit's weights over the columns of the code, minus its threshold. */
static inline void sdnn_potentials(const sdnn_model* model, const sdnn_code* code,
                                   int32_t* potentials) {
  const sdnn_column* column = code->columns;
  uint32_t unit, left;
  for (unit = 0; unit < SDNN_N_UNITS; ++unit) potentials[unit] = -model->thresholds[unit];
  for (left = code->n_positive; left > 0; --left, ++column) {
    const int16_t* const weights = model->weights + (uint32_t)*column * SDNN_N_UNITS;
    for (unit = 0; unit < SDNN_N_UNITS; ++unit) potentials[unit] += weights[unit];
  }
  column = code->columns + SDNN_MOST_COLUMNS - code->n_negative;
  for (left = code->n_negative; left > 0; --left, ++column) {
    const int16_t* const weights = model->weights + (uint32_t)*column * SDNN_N_UNITS;
    for (unit = 0; unit < SDNN_N_UNITS; ++unit) potentials[unit] -= weights[unit];
  }
}

/* Writes the total of each group: its number of firing units, or the potential of its only unit. */
static inline void sdnn_totals_of(const int32_t* potentials, sdnn_total* totals) {
#if SDNN_COUNTS_UNITS
  uint32_t group, unit;
  for (group = 0; group < SDNN_N_GROUPS; ++group, potentials += SDNN_GROUP_SIZE) {
    totals[group] = 0;
    for (unit = 0; unit < SDNN_GROUP_SIZE; ++unit) totals[group] += potentials[unit] > 0;
  }
#else
  uint32_t unit;
  for (unit = 0; unit < SDNN_N_UNITS; ++unit) totals[unit] = potentials[unit];
#endif
}

/* Encodes a sample and computes the units' potentials. Returns whether every value has a bin. */
static inline int sdnn_read(const sdnn_model* model, const double* x, sdnn_code* code,
                            int32_t* potentials) {
  uint32_t bins[SDNN_N_INPUTS];
  if (!sdnn_bins_of(x, bins)) return 0;
  sdnn_encode(bins, code);
  sdnn_potentials(model, code, potentials);
  return 1;
}

/* Writes the totals for a sample. Returns whether every value has a bin. */
static inline int sdnn_predicted_totals(const sdnn_model* model, const double* x,
                                        sdnn_total* totals) {
  int32_t potentials[SDNN_N_UNITS];
  sdnn_code code;
  if (!sdnn_read(model, x, &code, potentials)) return 0;
  sdnn_totals_of(potentials, totals);
  return 1;
}

#define SDNN_MODEL_PARAMETER const sdnn_model *model,
#define SDNN_MODEL model,
#define SDNN_RANGES model->ranges
#include "sdnn_predictions.h"

/* Whether a sample may be learned as far as its numbers are within their ranges. */
static inline int sdnn_is_within(const double* x) {
#if SDNN_REFUSES_OUTSIDE
  uint32_t i;
  for (i = 0; i < SDNN_N_INPUTS; ++i) {
    const sdnn_input* const input = &sdnn_inputs[i];
    const sdnn_real* const values = sdnn_values + input->first_value;
    const sdnn_real number = sdnn_bits_of(x[input->column]);
    const uint32_t last = input->type == SDNN_EVEN ? 1 : input->n_values - 2u;
    if (input->type > SDNN_KNOTS || (number & ~SDNN_MINUS) > SDNN_INFINITY) continue;
    if (sdnn_less(number, values[0]) || sdnn_less(values[last], number)) return 0;
  }
#else
  (void)x;
#endif
  return 1;
}

/* Corrects units by a code. Returns 0, and changes nothing, if a weight or a threshold would leave
 * its range. */
static inline int sdnn_correct(sdnn_model* model, const sdnn_code* code,
                               const sdnn_corrections* corrections) {
  const uint32_t first_negative = SDNN_MOST_COLUMNS - code->n_negative;
  uint32_t i, k;
  for (k = 0; k < corrections->n; ++k) {
    const uint32_t unit = corrections->units[k];
    const int32_t threshold = model->thresholds[unit];
    if (model->largest[unit] == SDNN_MOST_WEIGHT) {
      model->largest[unit] = sdnn_largest_weight(model, unit);
    }
    if (model->largest[unit] == SDNN_MOST_WEIGHT || threshold >= SDNN_MOST_THRESHOLD ||
        threshold <= -SDNN_MOST_THRESHOLD) {
      return 0;
    }
  }
  for (k = 0; k < corrections->n; ++k) {
    model->thresholds[corrections->units[k]] -= corrections->directions[k];
    ++model->largest[corrections->units[k]];
  }
  for (i = 0; i < SDNN_MOST_COLUMNS; ++i) {
    int16_t* weights;
    if (i == code->n_positive) i = first_negative;
    if (i == SDNN_MOST_COLUMNS) break;
    weights = model->weights + (uint32_t)code->columns[i] * SDNN_N_UNITS;
    for (k = 0; k < corrections->n; ++k) {
      const int32_t change =
          i < code->n_positive ? corrections->directions[k] : -corrections->directions[k];
      weights[corrections->units[k]] = (int16_t)(weights[corrections->units[k]] + change);
    }
  }
  return 1;
}

/* Lists a correction, in direction 1 or -1, of a unit. */
static inline void sdnn_add_correction(sdnn_corrections* corrections, uint32_t unit,
                                       int32_t direction) {
  corrections->units[corrections->n] = (uint16_t)unit;
  corrections->directions[corrections->n] = (int8_t)direction;
  ++corrections->n;
}

#if SDNN_COUNTS_UNITS

/* The number of units to correct: the share of those missing or superfluous, at least 1. */
static inline uint32_t sdnn_n_corrected(int32_t n) {
#if SDNN_CORRECTS_SHARE
  const sdnn_real share = sdnn_times(SDNN_SHARE, sdnn_real_of(n, 0));
  n = sdnn_whole(sdnn_plus(sdnn_real_of(1, -1), share));
#endif
  return n < 1 ? 1 : (uint32_t)n;
}

/* The p-delta rule for a group: corrects the units nearest to their threshold, the lowest index
 * first, of those that fire wrongly or are wrongly silent. */
static inline void sdnn_correct_group(const int32_t* potentials, uint32_t first_unit,
                                      sdnn_total total, int32_t target,
                                      sdnn_corrections* corrections) {
  const int32_t direction = total < target ? 1 : -1;
  const int fires = total > target;
  uint32_t n, distance, least = 0, last = 0;
  if (total == target) return;
  n = sdnn_n_corrected(fires ? total - target : target - total);
  for (; n > 0; --n) {
    /* The next distance and index after those of the last unit. */
    uint32_t unit, best = SDNN_GROUP_SIZE, best_distance = UINT32_MAX;
    for (unit = 0; unit < SDNN_GROUP_SIZE; ++unit) {
      const int32_t potential = potentials[unit];
      if ((potential > 0) != fires) continue;
      distance = potential > 0 ? (uint32_t)potential : 0 - (uint32_t)potential;
      if (distance < least || (distance == least && unit < last)) continue;
      if (distance >= best_distance) continue;
      best_distance = distance;
      best = unit;
    }
    sdnn_add_correction(corrections, first_unit + best, direction);
    least = best_distance;
    last = best + 1;
  }
}

/* Moves the numbers of firing units of all groups to their targets. */
static inline int sdnn_learn_targets(sdnn_model* model, const sdnn_code* code,
                                     const int32_t* potentials, const int32_t* targets) {
  sdnn_total totals[SDNN_N_GROUPS];
  sdnn_corrections corrections;
  uint32_t group;
  corrections.n = 0;
  sdnn_totals_of(potentials, totals);
  for (group = 0; group < SDNN_N_GROUPS; ++group) {
    const uint32_t first = group * SDNN_GROUP_SIZE;
    sdnn_correct_group(potentials + first, first, totals[group], targets[group], &corrections);
  }
  return sdnn_correct(model, code, &corrections);
}

#endif

#if !SDNN_IS_CLASSIFIER

#define SDNN_EXPONENT(x) ((x) >> 52 & 2047)
#define SDNN_FURTHEST (UINT64_C(2023) << 52) /* 2^1000 */

/* The firing count of a target, not rounded; those far out of range are 2^100 or minus that. */
static inline sdnn_real sdnn_count_of(const sdnn_real* range, sdnn_real target) {
  const sdnn_real step = sdnn_step(range), far = sdnn_real_of(1, 100);
  sdnn_real distance;
  if ((target & ~SDNN_MINUS) >= SDNN_FURTHEST) return far | (target & SDNN_MINUS);
  distance = sdnn_minus(target, range[0]);
  if (SDNN_EXPONENT(distance) > SDNN_EXPONENT(step) + 100) return far | (distance & SDNN_MINUS);
  return sdnn_over(distance, step);
}

static inline int sdnn_is_outside(const sdnn_real* range, sdnn_real target) {
  return sdnn_less(target, range[0]) || sdnn_less(range[1], target);
}

/* Widens a range to a target outside, by at most its width and margins. */
static inline void sdnn_widen(sdnn_real* range, sdnn_real target) {
  const sdnn_real margin = SDNN_MARGIN, low = range[0], high = range[1], two = sdnn_real_of(2, 0);
  const sdnn_real nearest = sdnn_between(target, sdnn_minus(sdnn_times(two, low), high),
                                         sdnn_minus(sdnn_times(two, high), low));
  if (sdnn_less(nearest, low)) {
    range[0] = sdnn_minus(nearest, sdnn_times(margin, sdnn_minus(high, nearest)));
  }
  if (sdnn_less(high, nearest)) {
    range[1] = sdnn_plus(nearest, sdnn_times(margin, sdnn_minus(nearest, low)));
  }
}

/* The targets of outputs, in firing units, and their ranges. Returns whether they can be learned.
 */
static inline int sdnn_targets_of(const double* y, sdnn_real* ranges, int32_t* targets) {
  const sdnn_real most = sdnn_real_of(SDNN_COUNTS_OF_RANGE, 0);
  uint32_t i;
  int is_beyond = 0, is_outside = 0;
  for (i = 0; i < SDNN_N_OUTPUTS; ++i) {
    const sdnn_real target = sdnn_bits_of(y[i]), *range = ranges + 2 * i;
    sdnn_real count;
    if ((target & ~SDNN_MINUS) >= SDNN_INFINITY) return 0;
    count = sdnn_count_of(range, target);
    is_beyond |= sdnn_less(count, 0) || sdnn_less(most, count);
    is_outside |= sdnn_is_outside(range, target);
  }
  if (is_beyond && is_outside) {
#if SDNN_REFUSES_OUTSIDE
    return 0;
#elif SDNN_WIDENS
    for (i = 0; i < SDNN_N_OUTPUTS; ++i) {
      sdnn_widen(ranges + 2 * i, sdnn_bits_of(y[i]));
      if ((ranges[2 * i] & ~SDNN_MINUS) >= SDNN_FURTHEST) return 0;
      if ((ranges[2 * i + 1] & ~SDNN_MINUS) >= SDNN_FURTHEST) return 0;
    }
#endif
  }
  for (i = 0; i < SDNN_N_OUTPUTS; ++i) {
    const sdnn_real count = sdnn_count_of(ranges + 2 * i, sdnn_bits_of(y[i]));
    targets[i] = sdnn_whole(sdnn_between(sdnn_plus(sdnn_real_of(1, -1), count), 0, most));
  }
  return 1;
}

/* Learns a sample. Returns 0, and changes nothing, for a sample that is refused, as sdnn_predict
 * does, a target that is not finite, or where a weight would exceed 16 bits. */
static inline int sdnn_learn(sdnn_model* model, const double* x, const double* y) {
  int32_t potentials[SDNN_N_UNITS], targets[SDNN_N_OUTPUTS];
  sdnn_real ranges[UINT32_C(2) * SDNN_N_OUTPUTS];
  sdnn_code code;
  uint32_t i;
  for (i = 0; i < UINT32_C(2) * SDNN_N_OUTPUTS; ++i) ranges[i] = model->ranges[i];
  if (!sdnn_targets_of(y, ranges, targets) || !sdnn_is_within(x)) return 0;
  if (!sdnn_read(model, x, &code, potentials)) return 0;
  if (!sdnn_learn_targets(model, &code, potentials, targets)) return 0;
  for (i = 0; i < UINT32_C(2) * SDNN_N_OUTPUTS; ++i) model->ranges[i] = ranges[i];
  return 1;
}

#else

#if !SDNN_COUNTS_UNITS
/* The perceptron rule: corrects every unit on the wrong side for a class. */
static inline void sdnn_correct_sides(const int32_t* potentials, uint32_t label,
                                      sdnn_corrections* corrections) {
  uint32_t unit = 0;
#if SDNN_IS_ONE_VS_ONE
  uint32_t i, j;
  for (i = 0; i < SDNN_N_CLASSES; ++i) {
    for (j = i + 1; j < SDNN_N_CLASSES; ++j, ++unit) {
      if ((i == label && potentials[unit] <= 0) || (j == label && potentials[unit] > 0)) {
        sdnn_add_correction(corrections, unit, i == label ? 1 : -1);
      }
    }
  }
#else
  for (; unit < SDNN_N_CLASSES; ++unit) {
    if ((potentials[unit] > 0) != (unit == label)) {
      sdnn_add_correction(corrections, unit, unit == label ? 1 : -1);
    }
  }
#endif
}
#endif

/* Learns a sample of a class. Returns 0, and changes nothing, for a sample that is refused, as
 * sdnn_predict does, a label that is no class, or where a weight would exceed 16 bits. */
static inline int sdnn_learn(sdnn_model* model, const double* x, uint32_t label) {
  int32_t potentials[SDNN_N_UNITS];
  sdnn_code code;
  if (label >= SDNN_N_CLASSES || !sdnn_is_within(x)) return 0;
  if (!sdnn_read(model, x, &code, potentials)) return 0;
#if SDNN_COUNTS_UNITS
  {
    int32_t targets[SDNN_N_GROUPS];
    uint32_t i;
    for (i = 0; i < SDNN_N_CLASSES; ++i) {
      targets[i] = i == label ? SDNN_COUNT_OF_CLASS : SDNN_COUNT_OF_OTHERS;
    }
    return sdnn_learn_targets(model, &code, potentials, targets);
  }
#else
  {
    sdnn_corrections corrections;
    corrections.n = 0;
    sdnn_correct_sides(potentials, label, &corrections);
    return sdnn_correct(model, &code, &corrections);
  }
#endif
}

#endif

#endif /* SDNN_LEARNING_ESTIMATOR_H */
