/* The bins of a sample's values, as the codings of an estimator divide them. */
#ifndef SDNN_CODED_INPUTS_H
#define SDNN_CODED_INPUTS_H

#include "sdnn_real.h"

typedef char sdnn_needs_doubles_of_64_bits[sizeof(double) == 8 ? 1 : -1];

/* Doubles are only moved: sdnn_real calculates with their bits, in integers. */
typedef union {
  double number;
  sdnn_real bits;
} sdnn_double;

/* A double as its bits, with which sdnn_real.h calculates. */
static inline sdnn_real sdnn_bits_of(double number) {
  sdnn_double both;
  both.number = number;
  return both.bits;
}

/* The double with these bits. */
static inline double sdnn_double_of(sdnn_real bits) {
  sdnn_double both;
  both.bits = bits;
  return both.number;
}

/* value 2^exponent as a double, such as a reading of a sensor with 8 bits after the point:
 * sdnn_number(reading, -8). Both are within 2^62 and 900. */
static inline double sdnn_number(int64_t value, int32_t exponent) {
  return sdnn_double_of(sdnn_real_of(value, exponent));
}

/* A value that a sample lacks: NaN. */
static inline double sdnn_missing(void) { return sdnn_double_of(UINT64_C(0x7ff8) << 48); }

/* x 2^n, rounded to the nearest, halves away from 0, as far as 32 bits hold it. */
static inline int32_t sdnn_fixed(double x, uint32_t n) {
  const sdnn_real bits = sdnn_bits_of(x), size = bits & ~SDNN_MINUS;
  const sdnn_real times = sdnn_times(size, sdnn_real_of(1, (int32_t)n));
  const sdnn_real half = sdnn_real_of(1, -1), limit = sdnn_real_of(INT32_MAX, 0);
  const int32_t whole = sdnn_whole(sdnn_between(sdnn_plus(times, half), 0, limit));
  return bits == size ? whole : -whole;
}

enum { SDNN_EVEN, SDNN_KNOTS, SDNN_CIRCULAR, SDNN_NUMBERS, SDNN_WORDS };

/* An input: which value of the sample it is, its bins but for that of missing values, and the place
 * of its numbers in sdnn_values:
 *   SDNN_EVEN      low, high, low / 2, high / 2 - low / 2
 *   SDNN_KNOTS     pairs of a value and its position
 *   SDNN_CIRCULAR  origin, period
 *   SDNN_NUMBERS   the categories; for SDNN_WORDS a value is the number of a category
 */
typedef struct {
  uint16_t column;
  uint16_t n_bins;
  uint8_t type;
  uint8_t may_lack;        /* whether missing values have a bin, n_bins */
  uint8_t unknown_is_lack; /* whether other categories are missing values */
  uint16_t n_values;
  uint32_t first_value;
} sdnn_input;

static const sdnn_input sdnn_inputs[SDNN_N_INPUTS] = {SDNN_INPUTS};

#define SDNN_REFUSED UINT32_MAX
#define SDNN_INFINITY (UINT64_C(2047) << 52)

static inline uint32_t sdnn_bin_at(sdnn_real position, uint32_t n_bins) {
  const uint32_t bin = (uint32_t)sdnn_whole(sdnn_times(position, sdnn_real_of(n_bins, 0)));
  return bin < n_bins ? bin : n_bins - 1;
}

/* The position in [0, 1] of a number in a range; `values` are its ends, half of the low end,
 * and half of its width. */
static inline sdnn_real sdnn_even_position(const sdnn_real* values, sdnn_real x) {
  const sdnn_real inside = sdnn_between(x, values[0], values[1]);
  if (values[3] << 1 == 0) return 0;
  return sdnn_over(sdnn_minus(sdnn_times(inside, sdnn_real_of(1, -1)), values[2]), values[3]);
}

#if SDNN_HAS_KNOTS
/* Linear interpolation, with the operations of numpy.interp. */
static inline sdnn_real sdnn_position_of_knots(const sdnn_real* knots, uint32_t n, sdnn_real x) {
  uint32_t low = 0, high = n; /* x lies from knot `low` on and before knot `high` */
  sdnn_real slope;
  if (sdnn_less(x, knots[0])) return knots[1];
  while (high - low > 1) {
    const uint32_t middle = (low + high) >> 1;
    if (sdnn_less(x, knots[2 * middle])) {
      high = middle;
    } else {
      low = middle;
    }
  }
  knots += 2 * low;
  if (high == n || !sdnn_less(knots[0], x)) return knots[1];
  slope = sdnn_over(sdnn_minus(knots[3], knots[1]), sdnn_minus(knots[2], knots[0]));
  return sdnn_plus(sdnn_times(slope, sdnn_minus(x, knots[0])), knots[1]);
}
#endif

#if SDNN_HAS_CIRCLES
/* The bin of a number on a circle: `values` are the beginning of a turn and its length. */
static inline uint32_t sdnn_bin_on_circle(const sdnn_real* values, uint32_t n_bins, sdnn_real x) {
  const sdnn_real digits = sdnn_real_of(1000000000, 0), shift = sdnn_real_of(1, 52);
  sdnn_real turns, place;
  uint32_t bin;
  if ((x & ~SDNN_MINUS) >> 52 >= 1023 + 500) return 0; /* from 2^500 on: whole turns */
  turns = sdnn_over(sdnn_minus(x, values[0]), values[1]);
  place = sdnn_times(sdnn_minus(turns, sdnn_floor(turns)), sdnn_real_of(n_bins, 0));
  /* Rounded to nine decimals; an addition of 2^52 rounds to integers. */
  place = sdnn_minus(sdnn_plus(sdnn_times(place, digits), shift), shift);
  bin = (uint32_t)sdnn_whole(sdnn_over(place, digits));
  return bin < n_bins ? bin : 0;
}
#endif

/* The number of a category, or n_bins. */
static inline uint32_t sdnn_category(const sdnn_input* input, const sdnn_real* values,
                                     sdnn_real x) {
  uint32_t number = 0;
  if (x << 1 == 0) x = 0; /* minus 0 */
  if (input->type == SDNN_WORDS) {
    if (sdnn_less(x, 0) || !sdnn_less(x, sdnn_real_of(input->n_bins, 0))) return input->n_bins;
    number = (uint32_t)sdnn_whole(x);
    return sdnn_real_of(number, 0) == x ? number : input->n_bins;
  }
  while (number < input->n_bins && values[number] != x) ++number;
  return number;
}

/* The bin of a value, or SDNN_REFUSED: a missing value without a bin, an unknown category,
 * infinity. */
static inline uint32_t sdnn_bin_of(const sdnn_input* input, sdnn_real x) {
  const sdnn_real* const values = sdnn_values + input->first_value;
  const sdnn_real size = x & ~SDNN_MINUS;
  if (size > SDNN_INFINITY) return input->may_lack ? input->n_bins : SDNN_REFUSED;
  if (input->type == SDNN_NUMBERS || input->type == SDNN_WORDS) {
    const uint32_t bin = sdnn_category(input, values, x);
    return bin < input->n_bins || input->unknown_is_lack ? bin : SDNN_REFUSED;
  }
  if (size == SDNN_INFINITY) return SDNN_REFUSED;
#if SDNN_HAS_CIRCLES
  if (input->type == SDNN_CIRCULAR) return sdnn_bin_on_circle(values, input->n_bins, x);
#endif
#if SDNN_HAS_KNOTS
  if (input->type == SDNN_KNOTS) {
    return sdnn_bin_at(sdnn_position_of_knots(values, input->n_values / 2u, x), input->n_bins);
  }
#endif
  return sdnn_bin_at(sdnn_even_position(values, x), input->n_bins);
}

/* The bins of a sample. Returns whether every value has a bin. */
static inline int sdnn_bins_of(const double* x, uint32_t* bins) {
  uint32_t i;
  for (i = 0; i < SDNN_N_INPUTS; ++i) {
    bins[i] = sdnn_bin_of(&sdnn_inputs[i], sdnn_bits_of(x[sdnn_inputs[i].column]));
    if (bins[i] == SDNN_REFUSED) return 0;
  }
  return 1;
}

#endif /* SDNN_CODED_INPUTS_H */
