/* Potentials of hidden units as sums of weights of a byte each.
 *
 * A word has the weights of four units, each 128 more than it is. The weights of two units are
 * added at once, 256 times before they overflow. */
#ifndef SDNN_WEIGHT_BYTES_H
#define SDNN_WEIGHT_BYTES_H

#include "sdnn_observation.h"

/* Adds `sign` times the weights of four units in n columns. A word has a byte for each unit; even
 * and odd bytes are summed in halves of 16 bits, which hold sums of 256 bytes. */
static inline void sdnn_add_columns(const uint32_t* weights, const sdnn_column* column, uint32_t n,
                                    uint32_t sign, uint32_t* sums) {
  while (n > 0) {
    uint32_t left = n < 256 ? n : 256, even = 0, odd = 0;
    n -= left;
    for (; left >= 4; left -= 4, column += 4) {
      const uint32_t first = weights[column[0]], second = weights[column[1]];
      const uint32_t third = weights[column[2]], fourth = weights[column[3]];
      even += first & UINT32_C(0xff00ff);
      odd += first >> 8;
      even += second & UINT32_C(0xff00ff);
      odd += second >> 8;
      even += third & UINT32_C(0xff00ff);
      odd += third >> 8;
      even += fourth & UINT32_C(0xff00ff);
      odd += fourth >> 8;
    }
    for (; left > 0; --left) {
      const uint32_t word = weights[*column++];
      even += word & UINT32_C(0xff00ff);
      odd += word >> 8;
    }
    odd -= even >> 16 << 8; /* the words shifted by 8 bits contained this even byte, too */
    sums[0] += sign * (even & 65535);
    sums[1] += sign * (odd & 65535);
    sums[2] += sign * (even >> 16);
    sums[3] += sign * (odd >> 16);
  }
}

/* Adds the weights of four units in the positive columns minus those in the negative ones, modulo
 * 2^32. All results fit. */
static inline void sdnn_add_signed(const uint32_t* weights, const sdnn_column* positive,
                                   uint32_t n_positive, const sdnn_column* negative,
                                   uint32_t n_negative, uint32_t* sums) {
  const uint32_t excess = 128 * (n_positive - n_negative);
  uint32_t i;
  sdnn_add_columns(weights, positive, n_positive, 1, sums);
  sdnn_add_columns(weights, negative, n_negative, UINT32_MAX, sums);
  for (i = 0; i < 4; ++i) sums[i] -= excess;
}

#endif /* SDNN_WEIGHT_BYTES_H */
