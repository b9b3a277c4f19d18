/* Rounding and elementary functions of real numbers, with the bits of std::round and
 * cpp/include/sdnn/core/elementary.hpp. */
#ifndef SDNN_ELEMENTARY_H
#define SDNN_ELEMENTARY_H

#include "sdnn_real.h"

#define SDNN_HALF (UINT64_C(1022) << 52)
#define SDNN_TWO (UINT64_C(1024) << 52)
#define SDNN_PI UINT64_C(0x400921fb54442d18)
#define SDNN_TWO_PI UINT64_C(0x401921fb54442d18)

/* The nearest integer, halves away from 0. */
static inline sdnn_real sdnn_nearest(sdnn_real x) {
  const sdnn_real size = x & ~SDNN_MINUS, truncated = sdnn_truncated(size);
  const int is_up = !sdnn_less(sdnn_minus(size, truncated), SDNN_HALF);
  return (is_up ? sdnn_plus(truncated, SDNN_ONE) : truncated) | (x & SDNN_MINUS);
}

/* A number with at most n_digits binary digits, which is a multiple of 2^least, ties to even: a
 * number of another floating point type. */
static inline sdnn_real sdnn_with_digits(sdnn_real x, int32_t n_digits, int32_t least) {
  int32_t exponent, shift;
  uint64_t fraction, rest;
  if (x << 1 == 0) return x;
  fraction = sdnn_fraction(x, &exponent);
  shift = 53 - n_digits;
  if (exponent + shift < least) shift = least - exponent;
  if (shift <= 0) return x;
  if (shift > 54) return x & SDNN_MINUS;
  rest = fraction & ((UINT64_C(1) << shift) - 1);
  fraction >>= shift;
  fraction +=
      rest > UINT64_C(1) << (shift - 1) || (rest == UINT64_C(1) << (shift - 1) && (fraction & 1));
  return sdnn_rounded(x & SDNN_MINUS, fraction, exponent + shift);
}

/* c[0] + c[1] z + ... + c[5] z^5. */
static inline sdnn_real sdnn_series(const sdnn_real* c, sdnn_real z) {
  const sdnn_real z2 = sdnn_times(z, z);
  const sdnn_real first = sdnn_plus(c[0], sdnn_times(c[1], z));
  const sdnn_real second = sdnn_plus(c[2], sdnn_times(c[3], z));
  const sdnn_real third = sdnn_plus(c[4], sdnn_times(c[5], z));
  return sdnn_plus(sdnn_plus(first, sdnn_times(z2, second)), sdnn_times(sdnn_times(z2, z2), third));
}

/* Sine and cosine of a number up to 10^5 in size. */
static inline void sdnn_sin_cos(sdnn_real x, sdnn_real* sine, sdnn_real* cosine) {
  static const sdnn_real of_sine[6] = {UINT64_C(0xbfc5555555555548), UINT64_C(0x3f8111111110f77c),
                                       UINT64_C(0xbf2a01a019bf7bcb), UINT64_C(0x3ec71de35649b231),
                                       UINT64_C(0xbe5ae5e591921411), UINT64_C(0x3de5d8f97c9f3d4b)};
  static const sdnn_real of_cosine[6] = {
      UINT64_C(0x3fa555555555554b), UINT64_C(0xbf56c16c16c1504b), UINT64_C(0x3efa01a019c9773c),
      UINT64_C(0xbe927e4f7f8e48ed), UINT64_C(0x3e21ee9e1583270b), UINT64_C(0xbda8fa99010a4496)};
  const sdnn_real two_over_pi = UINT64_C(0x3fe45f306dc9c883);
  const sdnn_real rounder = UINT64_C(0x4338000000000000); /* 1.5 2^52 */
  const sdnn_real half_pi_1 = UINT64_C(0x3ff921fb54440000);
  const sdnn_real half_pi_2 = UINT64_C(0x3d868c234c4c0000);
  const sdnn_real half_pi_3 = UINT64_C(0x3b298a2e03707345);
  const sdnn_real a = x & ~SDNN_MINUS;
  const sdnn_real shifted = sdnn_plus(sdnn_times(a, two_over_pi), rounder);
  const sdnn_real n = sdnn_minus(shifted, rounder);
  const sdnn_real coarse = sdnn_minus(a, sdnn_times(n, half_pi_1));
  const sdnn_real correction = sdnn_times(n, half_pi_2);
  const sdnn_real r = sdnn_minus(coarse, correction);
  const sdnn_real tail =
      sdnn_minus(sdnn_minus(sdnn_minus(coarse, r), correction), sdnn_times(n, half_pi_3));
  const sdnn_real z = sdnn_times(r, r), half_z = sdnn_times(SDNN_HALF, z);
  const sdnn_real one_minus = sdnn_minus(SDNN_ONE, half_z);
  const sdnn_real sine_of_r =
      sdnn_plus(r, sdnn_plus(sdnn_times(sdnn_times(z, r), sdnn_series(of_sine, z)),
                             sdnn_times(tail, one_minus)));
  const sdnn_real rest =
      sdnn_minus(sdnn_minus(sdnn_minus(SDNN_ONE, one_minus), half_z), sdnn_times(r, tail));
  const sdnn_real cosine_of_r = sdnn_plus(
      one_minus, sdnn_plus(rest, sdnn_times(sdnn_times(z, z), sdnn_series(of_cosine, z))));
  *sine = (shifted & 1 ? cosine_of_r : sine_of_r) ^ (shifted & 2) << 62 ^ (x & SDNN_MINUS);
  *cosine = (shifted & 1 ? sine_of_r : cosine_of_r) ^ ((shifted + 1) & 2) << 62;
}

/* The angle of the point (x, y), from -pi to pi, unless a number is near the largest ones. */
static inline sdnn_real sdnn_atan2(sdnn_real y, sdnn_real x) {
  static const sdnn_real series[13] = {
      UINT64_C(0xbfd5555555555555), UINT64_C(0x3fc99999999998e0), UINT64_C(0xbfc24924924881f5),
      UINT64_C(0x3fbc71c71c014e0d), UINT64_C(0xbfb745d16016ea5f), UINT64_C(0x3fb3b138e4b5b747),
      UINT64_C(0xbfb110ea393fffe2), UINT64_C(0x3fae1a795c3fb24f), UINT64_C(0xbfaad441c37157fa),
      UINT64_C(0x3fa7b1d7856d14a5), UINT64_C(0xbfa37ce51c509047), UINT64_C(0x3f999984c3613cd5),
      UINT64_C(0xbf82dd40041c2c27)};
  static const sdnn_real eighths[5] = {0, UINT64_C(0x3fe921fb54442d18),
                                       UINT64_C(0x3ff921fb54442d18), UINT64_C(0x4002d97c7f3321d2),
                                       UINT64_C(0x400921fb54442d18)};
  static const sdnn_real rests[5] = {0, UINT64_C(0x3c81a62633145c07), UINT64_C(0x3c91a62633145c07),
                                     UINT64_C(0x3c9a79394c9e8a0a), UINT64_C(0x3ca1a62633145c07)};
  const sdnn_real x_size = x & ~SDNN_MINUS, y_size = y & ~SDNN_MINUS;
  const int is_steep = sdnn_less(x_size, y_size);
  const sdnn_real a = is_steep ? y_size : x_size, b = is_steep ? x_size : y_size;
  sdnn_real r = 0, tail = 0, z, sum = series[12], rest;
  uint32_t i, n_eighths = 0; /* from the nearer axis, to which r is added */
  if (sdnn_less(sdnn_times(SDNN_HALF, a), b)) {
    const sdnn_real both = sdnn_plus(b, a);
    n_eighths = 1;
    r = sdnn_over(sdnn_minus(b, a), both);
    tail = sdnn_times(r ^ SDNN_MINUS, sdnn_over(sdnn_minus(b, sdnn_minus(both, a)), both));
  } else if (b != 0) {
    r = sdnn_over(b, a);
  }
  z = sdnn_times(r, r);
  for (i = 12; i > 0; --i) sum = sdnn_plus(sdnn_times(sum, z), series[i - 1]);
  rest = sdnn_plus(
      r, sdnn_plus(sdnn_times(sdnn_times(r, z), sum), sdnn_times(tail, sdnn_minus(SDNN_ONE, z))));
  if (is_steep) {
    n_eighths = 2 - n_eighths;
    rest ^= SDNN_MINUS;
  }
  if (x >> 63) {
    n_eighths = 4 - n_eighths;
    rest ^= SDNN_MINUS;
  }
  rest = sdnn_plus(eighths[n_eighths], sdnn_plus(rest, rests[n_eighths]));
  return (rest & ~SDNN_MINUS) | (y & SDNN_MINUS);
}

#endif /* SDNN_ELEMENTARY_H */
