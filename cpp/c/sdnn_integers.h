/* Integer arithmetic without division. */
#ifndef SDNN_INTEGERS_H
#define SDNN_INTEGERS_H

#include <stdint.h>

/* Numbers below 0 are shifted to the right as all compilers do it: rounded down. */
typedef char sdnn_needs_arithmetic_shifts[-1 >> 1 == -1 ? 1 : -1];

/* a / b and the rest, without a division. Requires that b is above 0. */
static inline uint64_t sdnn_quotient(uint64_t a, uint64_t b, uint64_t* rest) {
  uint64_t quotient = 0;
  uint32_t n = 0;
  for (; b <= a >> 1; b <<= 1) ++n;
  for (;; --n, b >>= 1) {
    quotient <<= 1;
    if (a >= b) {
      a -= b;
      quotient |= 1;
    }
    if (n == 0) break;
  }
  *rest = a;
  return quotient;
}

/* a b / 2^n, rounded to the nearest, halves up. */
static inline int64_t sdnn_scaled(int64_t a, int64_t b, uint32_t n) {
  return n == 0 ? a * b : (a * b + (INT64_C(1) << (n - 1))) >> n;
}

#endif /* SDNN_INTEGERS_H */
