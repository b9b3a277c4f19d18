/* A linear readout of the code: values of actions as sums of 32-bit weights. */
#ifndef SDNN_READOUT_H
#define SDNN_READOUT_H

#include "sdnn_observation.h"

static const sdnn_coding sdnn_the_coding = {sdnn_patterns, sdnn_modified, sdnn_modifiers,
                                            sdnn_units};

/* The sum of n numbers of a row. They are below 2^23 in size, so 256 of them fit into 32 bits. */
static inline int64_t sdnn_sum_of_columns(const int32_t* row, const sdnn_column* column,
                                          uint32_t n) {
  int64_t total = 0;
  while (n > 0) {
    uint32_t left = n < 256 ? n : 256;
    int32_t sum = 0;
    n -= left;
    for (; left >= 4; left -= 4, column += 4) {
      sum += row[column[0]] + row[column[1]] + row[column[2]] + row[column[3]];
    }
    for (; left > 0; --left) sum += row[*column++];
    total += sum;
  }
  return total;
}

/* The numbers of a readout unit, times the code. */
static inline int64_t sdnn_sum_of_row(const int32_t* row, const sdnn_code* code) {
  const sdnn_column* const negative = code->columns + SDNN_MOST_COLUMNS - code->n_negative;
  return sdnn_sum_of_columns(row, code->columns, code->n_positive) -
         sdnn_sum_of_columns(row, negative, code->n_negative);
}

/* Replaces the sums of rows by those of the windows of n actions. */
static inline void sdnn_add_windows(int64_t* sums, uint32_t n) {
#if SDNN_ACTION_WINDOW > 1
  uint32_t a, i;
  for (a = 0; a < n; ++a) {
    for (i = 1; i < SDNN_ACTION_WINDOW; ++i) sums[a] += sums[a + i];
  }
#else
  (void)sums;
  (void)n;
#endif
}

/* The values of the actions of dimension d. `sums` has room for SDNN_MOST_ROWS numbers. */
static inline void sdnn_sums(const int32_t* rows, const sdnn_code* code, uint32_t d,
                             int64_t* sums) {
  const uint32_t n = sdnn_n_actions[d];
  uint32_t i;
  rows += sdnn_first_rows[d] * SDNN_N_COLUMNS;
  for (i = 0; i < n + SDNN_ACTION_WINDOW - 1; ++i) {
    sums[i] = sdnn_sum_of_row(rows + i * SDNN_N_COLUMNS, code);
  }
  sdnn_add_windows(sums, n);
}

/* The largest of n values. */
static inline int64_t sdnn_largest(const int64_t* sums, uint32_t n) {
  int64_t largest = sums[0];
  uint32_t a;
  for (a = 1; a < n; ++a) {
    if (sums[a] > largest) largest = sums[a];
  }
  return largest;
}

#endif /* SDNN_READOUT_H */
