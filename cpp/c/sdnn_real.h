/* Real numbers: the 64 bits of IEEE 754, calculated in integers and rounded to the nearest, ties to
 * even. So they are the library's on every processor and with all options of a compiler. There are
 * no infinities and no NaN.
 *
 * The bits are a sign, 11 of the exponent e and 52 of the fraction f: the number is
 * (2^52 + f) 2^(e - 1075), or f 2^-1074 if e is 0. For x other than 0, x << 1 is above 0, and among
 * positive numbers the larger one has the larger bits. */
#ifndef SDNN_REAL_H
#define SDNN_REAL_H

#include <stdint.h>

typedef uint64_t sdnn_real;
#define SDNN_MINUS (UINT64_C(1) << 63)
#define SDNN_ONE (UINT64_C(1023) << 52)

/* The number fraction 2^exponent with a sign, rounded. The lowest bit of the fraction must be 1 if
 * there was a rest below it, so that the fraction does not look like a tie. It is shifted to 63
 * bits here: 53 that are kept, with the leading one, and 10 that round. */
static inline sdnn_real sdnn_rounded(uint64_t sign, uint64_t fraction, int32_t exponent) {
  uint64_t shift;
  if (fraction == 0) return sign;
  if (fraction >> 63) {
    fraction = fraction >> 1 | (fraction & 1);
    ++exponent;
  }
  for (; fraction >> 46 == 0; exponent -= 16) fraction <<= 16;
  for (; fraction >> 62 == 0; --exponent) fraction <<= 1;
  exponent += 1085;
  if (exponent < 1) {
    shift = (uint64_t)(1 - exponent);
    fraction = shift < 63 ? fraction >> shift | (fraction << (64 - shift) != 0) : 1;
    exponent = 1;
  }
  shift = fraction & 1023;
  fraction >>= 10;
  fraction += shift > 512 || (shift == 512 && (fraction & 1));
  return sign | (((uint64_t)(exponent - 1) << 52) + fraction);
}

/* value 2^exponent. */
static inline sdnn_real sdnn_real_of(int64_t value, int32_t exponent) {
  return value < 0 ? sdnn_rounded(SDNN_MINUS, 0 - (uint64_t)value, exponent)
                   : sdnn_rounded(0, (uint64_t)value, exponent);
}

/* The fraction, from 2^52 on, and the exponent of a number that is not 0. */
static inline uint64_t sdnn_fraction(sdnn_real x, int32_t* exponent) {
  uint64_t fraction = x & ((UINT64_C(1) << 52) - 1);
  *exponent = (int32_t)(x >> 52 & 2047) - 1075;
  if (*exponent > -1075) return fraction | UINT64_C(1) << 52;
  for (++*exponent; fraction >> 52 == 0; --*exponent) fraction <<= 1;
  return fraction;
}

/* The sum of two doubles, rounded like IEEE 754: fractions are aligned by their exponents, and
 * bits that are shifted out leave a mark in the last one. */
static inline sdnn_real sdnn_plus(sdnn_real a, sdnn_real b) {
  int32_t exponent, other;
  uint64_t x, y, shift;
  if (a << 1 == 0) return b << 1 == 0 ? a & b : b;
  if (b << 1 == 0) return a;
  if (a << 1 < b << 1) {
    const sdnn_real smaller = a;
    a = b;
    b = smaller;
  }
  x = sdnn_fraction(a, &exponent) << 9;
  y = sdnn_fraction(b, &other) << 9;
  shift = (uint64_t)(exponent - other);
  if (shift > 0) y = shift < 63 ? y >> shift | (y << (64 - shift) != 0) : 1;
  if (!((a ^ b) >> 63)) return sdnn_rounded(a & SDNN_MINUS, x + y, exponent - 9);
  return x == y ? 0 : sdnn_rounded(a & SDNN_MINUS, x - y, exponent - 9);
}

static inline sdnn_real sdnn_minus(sdnn_real a, sdnn_real b) {
  return sdnn_plus(a, b ^ SDNN_MINUS);
}

/* The product of two doubles, rounded like IEEE 754; fractions are multiplied in halves of 32
 * bits. */
static inline sdnn_real sdnn_times(sdnn_real a, sdnn_real b) {
  const uint64_t sign = (a ^ b) & SDNN_MINUS, low_bits = UINT32_MAX;
  int32_t exponent, other;
  uint64_t x, y, low, middle, more;
  if (a << 1 == 0 || b << 1 == 0) return sign;
  x = sdnn_fraction(a, &exponent) << 11;
  y = sdnn_fraction(b, &other) << 11;
  low = (x & low_bits) * (y & low_bits);
  middle = (x >> 32) * (y & low_bits) + (low >> 32);
  more = (x & low_bits) * (y >> 32) + (middle & low_bits);
  x = (x >> 32) * (y >> 32) + (middle >> 32) + (more >> 32);
  x |= ((low | more) & low_bits) != 0;
  return sdnn_rounded(sign, x, exponent + other + 42);
}

/* The quotient of two doubles, rounded like IEEE 754, by long division. Requires b other than
 * 0. */
static inline sdnn_real sdnn_over(sdnn_real a, sdnn_real b) {
  const uint64_t sign = (a ^ b) & SDNN_MINUS;
  int32_t exponent, other, i;
  uint64_t x, y, quotient = 0;
  if (a << 1 == 0) return sign;
  x = sdnn_fraction(a, &exponent);
  y = sdnn_fraction(b, &other);
  for (i = 0; i < 56; ++i, x <<= 1) {
    quotient <<= 1;
    if (x >= y) {
      x -= y;
      quotient |= 1;
    }
  }
  return sdnn_rounded(sign, quotient << 1 | (x != 0), exponent - other - 56);
}

/* Whether a < b. Zeros of both signs are equal. */
static inline int sdnn_less(sdnn_real a, sdnn_real b) {
  if ((a | b) << 1 == 0) return 0;
  if ((a ^ b) >> 63) return a >> 63 != 0;
  return a >> 63 ? b < a : a < b;
}

/* The number x, limited to the range from `low` to `high`. */
static inline sdnn_real sdnn_between(sdnn_real x, sdnn_real low, sdnn_real high) {
  return sdnn_less(x, low) ? low : sdnn_less(high, x) ? high : x;
}

/* A number without its fraction, towards 0. From 2^52 on, of the exponent 1075, it has none. */
static inline sdnn_real sdnn_truncated(sdnn_real x) {
  const uint32_t exponent = (uint32_t)(x >> 52 & 2047);
  if (exponent < 1023) return x & SDNN_MINUS;
  if (exponent >= 1075) return x;
  return x >> (1075 - exponent) << (1075 - exponent);
}

/* The largest integer that is not above a number, as a real number. */
static inline sdnn_real sdnn_floor(sdnn_real x) {
  const sdnn_real truncated = sdnn_truncated(x);
  return x >> 63 && truncated != x ? sdnn_minus(truncated, SDNN_ONE) : truncated;
}

/* The largest integer that is not above a number from 0 to 2^31, as an integer. */
static inline int32_t sdnn_whole(sdnn_real x) {
  const uint32_t shift = 1075 - (uint32_t)(x >> 52 & 2047);
  return shift > 52 ? 0 : (int32_t)(((x & ((UINT64_C(1) << 52) - 1)) | UINT64_C(1) << 52) >> shift);
}

#endif /* SDNN_REAL_H */
