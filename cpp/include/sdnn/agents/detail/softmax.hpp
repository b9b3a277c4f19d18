/// The softmax of integer preferences, exact on every processor.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents::detail {

/// An action's part of a softmax.
struct SoftmaxTerm {
  std::uint32_t weight = 0;      ///< exp(h - max h), in units of 2^-30; 0 where it is not allowed
  std::int32_t probability = 0;  ///< in units of 2^-16
  /// p (ln p + H) in units of 2^-16: minus the derivative of the entropy H by the preference.
  std::int32_t entropy_slope = 0;
};

inline constexpr int kExponentBits = 20;  ///< fractional bits of logarithms to the base 2

/// Returns 2^-x in units of 2^-30, with an error up to 5e-6; x, below 64, is in units of 2^-20.
constexpr std::int64_t power_of_half(std::int64_t x) noexcept {
  // Coefficients of a polynomial of degree 4 for 2^-f, f in [0, 1), that is exact at both ends.
  constexpr std::int64_t kCoefficients[] = {7356191, -57204762, 257158220, -744180561, 1 << 30};
  const std::int64_t fraction = x & ((1 << kExponentBits) - 1);
  std::int64_t power = 0;
  for (const std::int64_t coefficient : kCoefficients) {
    power = coefficient + approximators::scaled(power, fraction, kExponentBits);
  }
  return power >> (x >> kExponentBits);
}

/// Returns log2(x / 2^30) in units of 2^-20, with an error of 1e-4 at most; x is at least 1.
constexpr std::int64_t log2_of(std::uint64_t x) noexcept {
  const int exponent = static_cast<int>(std::bit_width(x)) - 1;
  const std::uint64_t mantissa = exponent <= 30 ? x << (30 - exponent) : x >> (exponent - 30);
  const auto fraction = static_cast<std::int64_t>((mantissa & ((1 << 30) - 1)) >> 10);
  // Coefficients of a polynomial of degree 4 for log2(1 + f), f in [0, 1), exact at both ends.
  constexpr std::int64_t kCoefficients[] = {-86117, 336784, -710703, 1508612, 0};
  std::int64_t logarithm = 0;
  for (const std::int64_t coefficient : kCoefficients) {
    logarithm = coefficient + approximators::scaled(logarithm, fraction, kExponentBits);
  }
  return (std::int64_t{exponent - 30} << kExponentBits) + logarithm;
}

/// Computes the softmax of preferences, integers in units of 2^-n_unit_bits with n_unit_bits >= 20.
/// Shapes: (n_actions,) each; `allowed` may be empty. Requires that an action is allowed.
inline void softmax(std::span<const std::int64_t> preferences, ActionMask allowed, int n_unit_bits,
                    std::span<SoftmaxTerm> terms) noexcept {
  constexpr std::int64_t kLog2E = 1549082005;  // log2(e), in units of 2^-30
  constexpr std::int64_t kLn2 = 45426;         // ln(2), in units of 2^-16
  constexpr std::int64_t kMostBits = std::int64_t{40} << kExponentBits;  // 2^-40 has weight 0
  std::int64_t best = INT64_MIN;
  for (std::size_t a = 0; a < terms.size(); ++a) {
    if (allows(allowed, a)) best = std::max(best, preferences[a]);
  }
  // The binary logarithm of best probability / probability, in units of 2^-20.
  const auto bits_below_best = [&](std::size_t a) {
    const std::int64_t below = (best - preferences[a]) >> (n_unit_bits - kExponentBits);
    return std::min(approximators::scaled(std::min(below, kMostBits), kLog2E, 30), kMostBits);
  };
  std::uint64_t sum = 0;
  for (std::size_t a = 0; a < terms.size(); ++a) {
    const bool is_allowed = allows(allowed, a);
    terms[a].weight =
        is_allowed ? static_cast<std::uint32_t>(power_of_half(bits_below_best(a))) : 0;
    sum += terms[a].weight;
  }
  const std::int64_t log2_sum = log2_of(sum);
  std::int64_t entropy = 0;  // in bits, in units of 2^-36
  for (std::size_t a = 0; a < terms.size(); ++a) {
    SoftmaxTerm& term = terms[a];
    term.probability =
        static_cast<std::int32_t>(((std::uint64_t{term.weight} << 16) + sum / 2) / sum);
    if (term.weight > 0) entropy += term.probability * (bits_below_best(a) + log2_sum);
  }
  entropy = approximators::scaled(entropy, 1, 16);
  for (std::size_t a = 0; a < terms.size(); ++a) {
    SoftmaxTerm& term = terms[a];
    term.entropy_slope = 0;
    if (term.weight == 0) continue;
    const std::int64_t excess = entropy - bits_below_best(a) - log2_sum;  // log2 p + H
    const std::int64_t in_nats = approximators::scaled(excess, kLn2, 16);
    term.entropy_slope = static_cast<std::int32_t>(
        approximators::scaled(term.probability * in_nats, 1, kExponentBits));
  }
}

/// Draws an action by its probability.
inline std::size_t draw_term(std::span<const SoftmaxTerm> terms, core::Random& random) noexcept {
  std::uint64_t sum = 0;
  for (const SoftmaxTerm& term : terms) sum += term.weight;
  std::uint64_t drawn = random.below(sum);
  std::size_t action = 0;
  while (drawn >= terms[action].weight) drawn -= terms[action++].weight;
  return action;
}

/// Finds a most probable action; `ties` decides between several.
inline std::size_t best_term(std::span<const SoftmaxTerm> terms, core::Random& ties) noexcept {
  const auto weight_of = [](const SoftmaxTerm& term) { return term.weight; };
  const std::uint32_t best = std::ranges::max(terms, {}, weight_of).weight;
  const auto n_tied = static_cast<std::uint64_t>(std::ranges::count(terms, best, weight_of));
  std::uint64_t n_left = n_tied > 1 ? ties.below(n_tied) : 0;
  std::size_t action = 0;
  while (terms[action].weight != best || n_left-- > 0) ++action;
  return action;
}

}  // namespace sdnn::agents::detail
