/// Elementary functions with the same bits everywhere.
///
/// std::sin and std::log may differ in the last bit between mathematical libraries, and a single
/// bit may change the outcome of a training. These functions use only IEEE + - * / sqrt and bit
/// operations. The compiler must not contract a * b + c (see detail/floating_point.hpp). "Our"
/// polynomials have coefficients that were fitted for this file.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::core {

/// The double next to pi, which is 1.2e-16 below it.
inline constexpr double kPi = 0x1.921fb54442d18p+1;
inline constexpr double kTwoPi = 2.0 * kPi;

/// sin x and cos x, of one number or of several side by side.
template <class Real>
struct BasicSinCos {
  Real sin;
  Real cos;
};
using SinCos = BasicSinCos<double>;

/// The largest |x| for which sin_cos returns numbers.
inline constexpr double kSinCosLimit = 1e5;

namespace detail {

/// c[0] + c[1] x + ... by Horner's rule.
template <std::size_t Size>
constexpr double polynomial(const std::array<double, Size>& c, double x) noexcept {
  double sum = c[Size - 1];
  for (std::size_t i = Size - 1; i > 0; --i) sum = sum * x + c[i - 1];
  return sum;
}

}  // namespace detail

/// sin x and cos x for |x| <= 1e5; NaN beyond, and for infinities and NaN.
///
/// `Real` is double or core::Lanes, with the same bits in every lane.
/// Error: the largest of 570,000 arguments, a sixth of them next to multiples of pi/2, was 0.82 ulp
/// (against 60 digits; the tests repeat a part of it). sin is exactly odd, -0 included, and cos
/// exactly even. It has no branch and no table, so that it runs in lanes, and short chains of
/// dependent operations, because an integrator needs the result soon.
/// Source: reduction by Cody and Waite, pi/2 as 34 + 34 + 53 bits; our minimax-like polynomials for
/// (sin r - r) / r^3 and (cos r - 1 + r^2/2) / r^4 in r^2, |r| <= pi/4 (relative error 2^-57.8 and
/// 2^-63.7).
template <class Real>
SDNN_INLINE BasicSinCos<Real> sin_cos(const Real& x) noexcept {
  constexpr std::uint64_t kSignBit = std::uint64_t{1} << 63;
  constexpr double kTwoOverPi = 0x1.45f306dc9c883p-1;
  constexpr double kRounder = 0x1.8p52;  // the low bits of x + kRounder are the nearest integer
  constexpr double kHalfPi1 = 0x1.921fb5444p+0, kHalfPi2 = 0x1.68c234c4cp-39;
  constexpr double kHalfPi3 = 0x1.98a2e03707345p-77;

  const auto sign = bits_of(x) & kSignBit;
  const Real a = magnitude(x);
  const Real zero_or_nan =  // NaN beyond the range; it is added to the result's rounding errors
      select(a <= kSinCosLimit, Real(0.0), Real(std::numeric_limits<double>::quiet_NaN()));

  // Reduces |x| to n pi/2 + r + tail with |r| <= pi/4. The products n kHalfPi1 and n kHalfPi2 have
  // at most 51 bits, so they and the first difference are exact.
  const Real shifted = a * kTwoOverPi + kRounder;
  const Real n = shifted - kRounder;
  const auto quadrant = bits_of(shifted);
  const Real coarse = a - n * kHalfPi1;
  const Real correction = n * kHalfPi2;
  const Real r = coarse - correction;
  const Real tail = ((coarse - r) - correction) - n * kHalfPi3 + zero_or_nan;

  const Real z = r * r, z2 = z * z, z4 = z2 * z2;
  const Real sin_poly = ((-0x1.5555555555548p-3 + 0x1.111111110f77cp-7 * z) +
                         z2 * (-0x1.a01a019bf7bcbp-13 + 0x1.71de35649b231p-19 * z)) +
                        z4 * (-0x1.ae5e591921411p-26 + 0x1.5d8f97c9f3d4bp-33 * z);
  const Real cos_poly = ((0x1.555555555554bp-5 + -0x1.6c16c16c1504bp-10 * z) +
                         z2 * (0x1.a01a019c9773cp-16 + -0x1.27e4f7f8e48edp-22 * z)) +
                        z4 * (0x1.1ee9e1583270bp-29 + -0x1.8fa99010a4496p-37 * z);
  const Real half_z = 0.5 * z;
  const Real one_minus = 1.0 - half_z;
  const auto sine = bits_of(Real(r + ((z * r) * sin_poly + tail * one_minus)));
  const auto cosine =
      bits_of(Real(one_minus + (((1.0 - one_minus) - half_z - r * tail) + z2 * cos_poly)));

  // In odd quadrants sine and cosine change places: x ^ (x ^ y) is y, and 0 - 1 has all bits set.
  // The sine is negated in quadrants 2 and 3, and for negative x; the cosine in 1 and 2. Bit 1 of
  // the quadrant, or of the quadrant + 1, becomes the sign bit, 63.
  const auto swap = (sine ^ cosine) & (std::uint64_t{0} - (quadrant & 1));
  const auto sin_sign = ((quadrant & 2) << 62) ^ sign;
  const auto cos_sign = ((quadrant + 1) & 2) << 62;
  return {double_of(sine ^ (swap ^ sin_sign)), double_of(cosine ^ (swap ^ cos_sign))};
}

/// The natural logarithm; log 0 = -inf, NaN for negative numbers and NaN.
///
/// Error: the largest of 285,000 arguments over the whole range was 0.79 ulp.
/// Source: x = 2^k (1 + f), s = f / (2 + f), log(1 + f) = 2 s + (2/3) s^3 + ..., summed so that the
/// large parts are exact; our coefficients (relative error 2^-59).
inline double log(double x) noexcept {
  constexpr std::uint64_t kMantissa = (std::uint64_t{1} << 52) - 1;
  constexpr std::uint64_t kOne = std::uint64_t{1023} << 52;  // the bits of 1.0
  constexpr std::uint64_t kSqrtHalf = 0x6a09e667f3bcd;       // mantissa of sqrt 2 and of sqrt 1/2
  constexpr double kLog2High = 0x1.62e42fefa38p-1, kLog2Low = 0x1.ef35793c7673p-45;
  constexpr std::array<double, 7> kSeries{
      0x1.5555555555595p-1, 0x1.999999997f1b0p-2, 0x1.249249428d962p-2, 0x1.c71c51900ef42p-3,
      0x1.7466572ea15f4p-3, 0x1.399f4f767d634p-3, 0x1.2f1db2c574a16p-3};

  if (!(x > 0.0)) {
    return x == 0.0 ? -std::numeric_limits<double>::infinity()
                    : std::numeric_limits<double>::quiet_NaN();
  }
  if (x > std::numeric_limits<double>::max()) return x;
  int exponent = -1023;
  if (x < std::numeric_limits<double>::min()) {  // subnormal
    x *= 0x1p54;
    exponent -= 54;
  }
  const auto bits = std::bit_cast<std::uint64_t>(x);
  exponent += static_cast<int>(bits >> 52);
  double m = std::bit_cast<double>((bits & kMantissa) | kOne);  // [1, 2)
  if ((bits & kMantissa) > kSqrtHalf) {                         // to (sqrt 1/2, sqrt 2]
    m *= 0.5;
    ++exponent;
  }
  const double f = m - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  const double series = z * detail::polynomial(kSeries, z);
  const double half_square = 0.5 * f * f;
  const double k = static_cast<double>(exponent);
  return k * kLog2High - ((half_square - (s * (half_square + series) + k * kLog2Low)) - f);
}

/// e^x; infinity above 709.78, gradually 0 below -708.4, NaN for NaN.
///
/// Error: the largest of 400,000 arguments with a normal result was 0.66 ulp; a subnormal result is
/// rounded a second time. It has no branch and no table, so that a loop over it can be vectorized.
/// Source: x = n log 2 + r, |r| <= log(2) / 2, log 2 as 42 + 53 bits; e^r = 1 + r + r^2/2 + r^3
/// p(r) with our polynomial (relative error 2^-59.8), summed so that the large parts are exact.
inline double exp(double x) noexcept {
  constexpr double kLog2Inverse = 0x1.71547652b82fep+0;
  constexpr double kRounder = 0x1.8p52;  // the low bits of x + kRounder are the nearest integer
  constexpr double kLog2High = 0x1.62e42fefa38p-1, kLog2Low = 0x1.ef35793c7673p-45;
  constexpr double kLowest = -746.0, kHighest = 710.0;  // e^x is 0 and infinity from here on
  constexpr std::uint64_t kTwiceBias = 2 * 1023;

  double a = x < kLowest ? kLowest : x;  // a comparison with NaN is false: NaN stays
  a = a > kHighest ? kHighest : a;
  const double shifted = a * kLog2Inverse + kRounder;
  const double n = shifted - kRounder;
  const double coarse = a - n * kLog2High;  // both exact: n has 11 bits, kLog2High 42
  const double correction = n * kLog2Low;
  const double r = coarse - correction;
  const double tail = (coarse - r) - correction;

  const double z = r * r, z2 = z * z, z4 = z2 * z2;
  const double poly = ((0x1.5555555555556p-3 + 0x1.5555555555555p-5 * r) +
                       z * (0x1.11111111109b3p-7 + 0x1.6c16c16c167e1p-10 * r)) +
                      z2 * ((0x1.a01a01a7c41d5p-13 + 0x1.a01a01a47b054p-16 * r) +
                            z * (0x1.71de0dae63bb3p-19 + 0x1.27e4e1f48534fp-22 * r)) +
                      z4 * (0x1.af38a9b0ec855p-26 + 0x1.1f66df7fca49fp-29 * r);
  const double one_plus = 1.0 + r;
  const double rest = (1.0 - one_plus) + r;  // the rounding error of the sum
  const double mantissa = one_plus + (rest + (tail + (0.5 * z + (r * z) * poly)));

  // 2^n is the product of two powers, 2^(n / 2) rounded down and the rest, because n may leave the
  // range of exponents. A double with the exponent bits e and no mantissa is 2^(e - 1023).
  const std::uint64_t biased =
      std::bit_cast<std::uint64_t>(shifted) - std::bit_cast<std::uint64_t>(kRounder) + kTwiceBias;
  const std::uint64_t half = biased >> 1;
  return mantissa * std::bit_cast<double>(half << 52) *
         std::bit_cast<double>((biased - half) << 52);
}

/// base^exponent of a base that is not negative, as e^(exponent log base).
///
/// Relative error: about (2 + |exponent log base|) 2^-52.
inline double power(double base, double exponent) noexcept { return exp(exponent * log(base)); }

/// The angle of the point (x, y), from -pi to pi: atan2 of the C library with the same bits
/// everywhere, signs of zeros, infinities and NaN included.
///
/// Error: the largest of 40,000,000 arguments was 1.47 ulp.
/// Source: with a >= b the magnitudes, atan(b / a) or, beyond 1/2, pi/4 + atan((b - a) / (b + a)),
/// where b - a is exact; our polynomial for (atan r - r) / r^3 in r^2, |r| <= 1/2 (relative error
/// 2^-59.9); multiples of pi/4 as 53 + 53 bits.
inline double atan2(double y, double x) noexcept {
  constexpr std::array<double, 13> kSeries{
      -0x1.5555555555555p-2, 0x1.99999999998e0p-3, -0x1.24924924881f5p-3, 0x1.c71c71c014e0dp-4,
      -0x1.745d16016ea5fp-4, 0x1.3b138e4b5b747p-4, -0x1.110ea393fffe2p-4, 0x1.e1a795c3fb24fp-5,
      -0x1.ad441c37157fap-5, 0x1.7b1d7856d14a5p-5, -0x1.37ce51c509047p-5, 0x1.99984c3613cd5p-6,
      -0x1.2dd40041c2c27p-7};
  // k pi / 4, k = 0 .. 4, and the parts of these that doubles lack.
  constexpr std::array<double, 5> kEighths{0.0, 0x1.921fb54442d18p-1, 0x1.921fb54442d18p+0,
                                           0x1.2d97c7f3321d2p+1, 0x1.921fb54442d18p+1};
  constexpr std::array<double, 5> kRests{0.0, 0x1.1a62633145c07p-55, 0x1.1a62633145c07p-54,
                                         0x1.a79394c9e8a0ap-54, 0x1.1a62633145c07p-53};
  constexpr double kHuge = 0x1p1022;

  if (std::isnan(x) || std::isnan(y)) return std::numeric_limits<double>::quiet_NaN();
  double a = std::abs(x), b = std::abs(y);
  const bool is_steep = b > a;
  if (is_steep) std::swap(a, b);
  double r = 0.0, tail = 0.0;
  std::size_t eighths = 0;  // multiples of pi / 4 that are added to atan r
  if (b > std::numeric_limits<double>::max()) {
    eighths = 1;  // both are infinite
  } else if (b > 0.0) {
    if (a >= kHuge) {  // a + b might overflow
      a *= 0.25;
      b *= 0.25;
    }
    if (b > 0.5 * a) {
      eighths = 1;
      const double sum = b + a;
      r = (b - a) / sum;
      tail = -r * ((b - (sum - a)) / sum);  // corrects the rounding error of the sum
    } else {
      r = b / a;
    }
  }
  const double z = r * r;
  double rest = r + (r * z * detail::polynomial(kSeries, z) + tail * (1.0 - z));
  if (is_steep) {
    eighths = 2 - eighths;
    rest = -rest;
  }
  if (std::signbit(x)) {
    eighths = 4 - eighths;
    rest = -rest;
  }
  return std::copysign(kEighths[eighths] + (rest + kRests[eighths]), y);
}

/// The quantile of the standard normal distribution for the probability `p`.
///
/// -inf at 0, +inf at 1, NaN outside [0, 1]. Relative error below 1e-15 (measured).
/// Source: Wichura, M. J. (1988). Algorithm AS 241, PPND16. Applied Statistics 37(3), 477-484.
inline double normal_quantile(double p) noexcept {
  using Coefficients = std::array<double, 8>;
  constexpr Coefficients kCentreTop{3.3871328727963666080e0, 1.3314166789178437745e2,
                                    1.9715909503065514427e3, 1.3731693765509461125e4,
                                    4.5921953931549871457e4, 6.7265770927008700853e4,
                                    3.3430575583588128105e4, 2.5090809287301226727e3};
  constexpr Coefficients kCentreBottom{1.0000000000000000000e0, 4.2313330701600911252e1,
                                       6.8718700749205790830e2, 5.3941960214247511077e3,
                                       2.1213794301586595867e4, 3.9307895800092710610e4,
                                       2.8729085735721942674e4, 5.2264952788528545610e3};
  constexpr Coefficients kMiddleTop{1.42343711074968357734e0,  4.63033784615654529590e0,
                                    5.76949722146069140550e0,  3.64784832476320460504e0,
                                    1.27045825245236838258e0,  2.41780725177450611770e-1,
                                    2.27238449892691845833e-2, 7.74545014278341407640e-4};
  constexpr Coefficients kMiddleBottom{1.0000000000000000000e0,   2.05319162663775882187e0,
                                       1.67638483018380384940e0,  6.89767334985100004550e-1,
                                       1.48103976427480074590e-1, 1.51986665636164571966e-2,
                                       5.47593808499534494600e-4, 1.05075007164441684324e-9};
  constexpr Coefficients kTailTop{6.65790464350110377720e0,  5.46378491116411436990e0,
                                  1.78482653991729133580e0,  2.96560571828504891230e-1,
                                  2.65321895265761230930e-2, 1.24266094738807843860e-3,
                                  2.71155556874348757815e-5, 2.01033439929228813265e-7};
  constexpr Coefficients kTailBottom{1.0000000000000000000e0,   5.99832206555887937690e-1,
                                     1.36929880922735805310e-1, 1.48753612908506148525e-2,
                                     7.86869131145613259100e-4, 1.84631831751005468180e-5,
                                     1.42151175831644588870e-7, 2.04426310338993978564e-15};
  const auto ratio = [](const Coefficients& top, const Coefficients& bottom, double x) {
    return detail::polynomial(top, x) / detail::polynomial(bottom, x);
  };

  const double centred = p - 0.5;
  if (centred >= -0.425 && centred <= 0.425) {
    return centred * ratio(kCentreTop, kCentreBottom, 0.180625 - centred * centred);  // 0.425^2
  }
  if (!(p >= 0.0 && p <= 1.0)) return std::numeric_limits<double>::quiet_NaN();
  if (p == 0.0 || p == 1.0) {
    return std::copysign(std::numeric_limits<double>::infinity(), centred);
  }
  const double depth = std::sqrt(-log(centred < 0.0 ? p : 1.0 - p));
  const double quantile = depth <= 5.0 ? ratio(kMiddleTop, kMiddleBottom, depth - 1.6)
                                       : ratio(kTailTop, kTailBottom, depth - 5.0);
  return centred < 0.0 ? -quantile : quantile;
}

}  // namespace sdnn::core
