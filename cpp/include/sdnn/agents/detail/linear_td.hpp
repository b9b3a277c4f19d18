/// True-online TD(lambda) with a linear readout, in one or several environments.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"

namespace sdnn::agents::detail {

/// Temporal-difference learning of a linear readout. An `Episode` has the members
///
/// | member    | meaning                                                                      |
/// |-----------|------------------------------------------------------------------------------|
/// | trace     | the eligibility trace of each weight                                         |
/// | present   | a workspace of the readout with the state whose value is corrected           |
/// | old_value | Q_old of true-online TD, in the readout's units                              |
/// | dt        | the duration of the transition whose error is learned                        |
/// | trace_dt  | the duration of the transition before, by which the trace must decay first   |
///
/// All numbers are integers: gamma in units of 2^-15, gamma * lambda in units of 2^-13, values in
/// the readout's unit.
///
/// In a transition of dt usual steps gamma is gamma^dt (semi-Markov), in the error as in the decay
/// of the trace. Lambda is not raised to a power: it says how far targets bootstrap at a decision,
/// however long that takes. (gamma lambda)^dt, by which credit fades with time, learned no faster
/// with random durations, and more slowly where long actions are chosen. Source: Bradtke, S., Duff,
/// M. (1994). Reinforcement learning methods for continuous-time Markov decision problems; Sutton,
/// R., Barto, A. (2018). Reinforcement learning, section 12.8 (traces with a discount that varies).
template <class Episode>
class LinearTD {
 public:
  using Readout = approximators::LinearSDNN;
  using Action = std::span<const std::size_t>;

  /// An error, r + gamma Q' - Q, and the drift Q - Q_old of the present value since it was computed
  /// as the next one; in the readout's units.
  struct Error {
    std::int64_t error, drift;
  };

  LinearTD(Readout readout, double discount, double trace_decay)
      : readout_(std::move(readout)),
        discount_(discount),
        trace_decay_(trace_decay),
        usual_discount_(discount_of(1.0)),
        usual_decay_(decay_of(1.0)) {}

  Readout& readout() noexcept { return readout_; }
  const Readout& readout() const noexcept { return readout_; }
  /// The factor by which the trace of an episode is to decay next, in units of 1 / kDecayOne.
  std::int32_t decay(const Episode& episode) const noexcept {
    return episode.trace_dt == 1.0 ? usual_decay_ : decay_of(episode.trace_dt);
  }

  /// Doubles the readout's unit until a reward fits.
  void fit_unit(double reward, Episodes<Episode>& episodes) {
    halve_old_values(readout_.fit_unit(reward), episodes);
  }

  /// Returns the value in units that `compute` computes, after doubling the readout's unit until
  /// the value fits. `other` is another value in units, which is converted with each doubling.
  template <class Compute>
  std::int64_t in_range(Episodes<Episode>& episodes, const Compute& compute,
                        std::int64_t* other = nullptr) {
    std::int64_t value = compute();
    while (Readout::is_too_large(value)) {
      readout_.double_unit();
      halve_old_values(1, episodes);
      if (other != nullptr) *other = approximators::halved(*other);
      value = compute();
    }
    return value;
  }

  /// Returns the TD error of the present state's action, and stores the next value Q', `next` in
  /// units, as Q_old of the next step. The term Q - Q_old of true-online TD is 0 unless `is_dutch`.
  Error error_of(Episode& episode, Episodes<Episode>& episodes, Action action, double reward,
                 std::int64_t next, bool is_dutch) {
    const std::int64_t value =
        in_range(episodes, [&] { return readout_.sum(episode.present, action); }, &next);
    const std::int64_t discount = episode.dt == 1.0 ? usual_discount_ : discount_of(episode.dt);
    const std::int64_t target =
        readout_.units_of(reward) + ((next * discount + (kDiscountOne >> 1)) >> kDiscountBits);
    const std::int64_t drift = is_dutch ? value - episode.old_value : 0;
    episode.old_value = next;
    return {target - value, drift};
  }

  /// Learns the error at a rate in units of 1 / kRateOne, and makes its transition the one before.
  void correct(Episode& episode, Episodes<Episode>& episodes, Action action, Error error,
               std::int32_t rate, bool is_dutch) {
    const int n_doubled = readout_.learn(episode.present.code(), action, episode.trace,
                                         {.error = error.error + error.drift,
                                          .correction = error.drift,
                                          .rate = rate,
                                          .decay = decay(episode),
                                          .is_dutch = is_dutch});
    episode.trace_dt = std::exchange(episode.dt, 1.0);
    halve_old_values(n_doubled, episodes);
  }

  /// Moves rows of weights along the code of the present state; see LinearSDNN::move_rows.
  void move_rows(Episode& episode, Episodes<Episode>& episodes,
                 std::span<const std::int64_t> errors, std::int32_t rate) {
    halve_old_values(readout_.move_rows(episode.present.code(), errors, rate), episodes);
  }

  /// Makes the unit of values smaller, and thus more precise, by the larger of two numbers of bits:
  /// - those that neither weights nor the rewards of the last window use, minus 8 bits for growth;
  /// - those by which the unit is too large for the recent rewards. It is small enough if values of
  ///   512 to 1,024 times their largest possible discounted sum just fit. Larger weights, which can
  ///   only be left over from larger rewards, are clipped then.
  ///
  /// The sizes, of the last window and the recent one, are those of RewardScale: powers of 2.
  void refine_unit(std::int32_t size_in_window, std::int32_t size, Episodes<Episode>& episodes) {
    if (!readout_.exponent()) return;
    const std::int32_t exponent = *readout_.exponent();
    const std::int64_t n_weights = readout_.n_weights_of(episodes.of(0).present.code());
    // With s = size - exponent, a reward is below 2^(s + 1) units. A discounted sum of rewards is
    // at most reward / (1 - gamma), which has `bits_of_sum` more bits.
    const std::int64_t one_minus_gamma = std::max<std::int64_t>(kDiscountOne - usual_discount_, 1);
    const auto bits_of_share = std::bit_width(static_cast<std::uint64_t>(one_minus_gamma));
    const int bits_of_sum = kDiscountBits + 1 - static_cast<int>(bits_of_share);
    const int most_bits = Readout::most_bits_of(n_weights) - bits_of_sum - kImplausibleBits;
    const int n_unused =
        std::min(readout_.spare_bits(), 30 - (size_in_window - exponent)) - kRoomBits;
    const int n_too_coarse = most_bits - (size - exponent);
    const int n_refined = readout_.refine_unit(std::max({n_unused, n_too_coarse, 0}));
    for (Episode& episode : episodes) {
      episode.old_value = Readout::refined(episode.old_value, n_refined);
    }
  }

 private:
  static constexpr int kDiscountBits = 15;
  static constexpr std::int64_t kDiscountOne = std::int64_t{1} << kDiscountBits;
  // Chosen constants of refine_unit.
  static constexpr int kRoomBits = 8;  ///< bits that stay unused, for growth of weights
  static constexpr int kImplausibleBits =
      10;  ///< values 2^10 times the largest sum are implausible

  std::int64_t discount_of(double dt) const noexcept {
    return std::lround(discount_over(discount_, dt) * static_cast<double>(kDiscountOne));
  }
  std::int32_t decay_of(double dt) const noexcept {
    return static_cast<std::int32_t>(
        std::lround(discount_over(discount_, dt) * trace_decay_ * approximators::kDecayOne));
  }
  /// Halves the stored values once for each doubling of the unit.
  void halve_old_values(int n_doubled, Episodes<Episode>& episodes) {
    for (; n_doubled > 0; --n_doubled) {
      for (Episode& episode : episodes) {
        episode.old_value = approximators::halved(episode.old_value);
      }
    }
  }

  Readout readout_;
  double discount_, trace_decay_;
  std::int64_t usual_discount_;  ///< of transitions with dt = 1
  std::int32_t usual_decay_;
};

}  // namespace sdnn::agents::detail
