/// Observations of the acrobot: normalized, redundant and noisy variables.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/environments/acrobot_state.hpp"

namespace sdnn::environments {

/// Treatment of a noisy value outside a sensor's range [0, 1].
enum class SensorEdge {
  wrap,      ///< for an angle: 1 is the same as 0, so the value is wrapped into [0, 1)
  saturate,  ///< the value is clipped
};
constexpr std::array<std::string_view, 2> words_of(SensorEdge) noexcept {
  return {"wrap", "saturate"};
}

/// Returns the fractional part of a number of turns, in [0, 1).
inline double wrap_to_unit(double x) noexcept {
  const double wrapped = x - std::floor(x);
  return wrapped < 1.0 ? wrapped : 0.0;  // a tiny negative x rounds to 1
}

/// Returns the nearest number in [0, 1].
inline double saturate_to_unit(double x) noexcept { return std::clamp(x, 0.0, 1.0); }

/// Returns the four basic observations s1..s4 of a state: the angles theta1 and theta2 as turns in
/// [0, 1), 1/2 for an angle of 0, and the angular velocities, such that -3 pi .. 3 pi and -5 pi ..
/// 5 pi rad/s become [0, 1]; others are clipped.
inline Eigen::Vector4d basic_observation(const AcrobotState& state) noexcept {
  constexpr double kSpeedRange1 = 6.0 * core::kPi, kSpeedRange2 = 10.0 * core::kPi;
  return {wrap_to_unit(state[0] / core::kTwoPi + 0.5), wrap_to_unit(state[1] / core::kTwoPi + 0.5),
          saturate_to_unit(state[2] / kSpeedRange1 + 0.5),
          saturate_to_unit(state[3] / kSpeedRange2 + 0.5)};
}

/// Returns s5, a measure like a kinetic energy: 2 ((s3 - 1/2)^2 + (s4 - 1/2)^2), in [0, 1].
inline double energy_sensor(double s3, double s4) noexcept {
  return 2.0 * ((s3 - 0.5) * (s3 - 0.5) + (s4 - 0.5) * (s4 - 0.5));
}

/// Returns s6, the height of the tip of equal links: (2 + cos 2 pi s1 - cos 2 pi (s1 + s2)) / 4, in
/// [0, 1]. The signs differ because s1 and s2 are both shifted by half a turn.
inline double height_sensor(double s1, double s2) noexcept {
  return (2.0 + core::sin_cos(core::kTwoPi * s1).cos -
          core::sin_cos(core::kTwoPi * (s1 + s2)).cos) /
         4.0;
}

/// Independent Gaussian noise on every channel of an observation.
class SensorNoise {
 public:
  /// Makes noise with the standard deviation `sigma`; `edges` has an entry per channel. Throws
  /// std::invalid_argument unless sigma is finite and not negative.
  SensorNoise(double sigma, std::vector<SensorEdge> edges, std::uint64_t seed, core::Stream stream)
      : sigma_(sigma), edges_(std::move(edges)), random_(seed, stream) {
    core::require(std::isfinite(sigma) && sigma >= 0.0, "noise", "finite and at least 0", sigma);
  }

  /// Adds a normal number to every channel in order; sigma = 0 draws nothing and changes nothing.
  /// Shapes: (n_channels,).
  void apply(std::span<double> values) noexcept {
    assert(values.size() == edges_.size());
    if (sigma_ == 0.0) return;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double noisy = values[i] + sigma_ * random_.normal();
      values[i] = edges_[i] == SensorEdge::wrap ? wrap_to_unit(noisy) : saturate_to_unit(noisy);
    }
  }

  std::size_t n_channels() const noexcept { return edges_.size(); }

 private:
  double sigma_;
  std::vector<SensorEdge> edges_;
  core::Random random_;
};

/// Variables to which noise is added; the paper does not say.
enum class NoiseEntry {
  every_sensor,   ///< all: s5 and s6 are computed from the true s1..s4 and have separate noise
  basic_sensors,  ///< s1..s4 alone: s5 and s6 are computed from the noisy values
};
constexpr std::array<std::string_view, 2> words_of(NoiseEntry) noexcept {
  return {"every_sensor", "basic_sensors"};
}

/// The variables of an observation and their noise (section 4.3).
struct SensorConfig {
  int n_sensors = 4;
  double noise = 0.0;
  NoiseEntry noise_entry = NoiseEntry::every_sensor;
  int n_constant = 0;
  int n_random = 0;

  /// The number of variables in an observation.
  int n_inputs() const noexcept { return n_sensors + n_constant + n_random; }

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("n_sensors", &SensorConfig::n_sensors,
                    "4: s1..s4; 5: s5, the energy, too; 6: s6, the height, too.",
                    core::within(4, 6)),
        core::field("noise", &SensorConfig::noise,
                    "Standard deviation of the noise on every sensor; 0.02 in the paper's noisy "
                    "cases.",
                    core::at_least(0)),
        core::field("noise_entry", &SensorConfig::noise_entry,
                    "Where noise enters: `every_sensor`: s5 and s6 are computed from the true "
                    "s1..s4 and get noise of their own; `basic_sensors`: they are computed from "
                    "the noisy ones. An assumption."),
        core::field("n_constant", &SensorConfig::n_constant,
                    "Useless inputs besides: always 1/2, with noise as on the sensors. Not in the "
                    "paper.",
                    core::within(0, 100)),
        core::field("n_random", &SensorConfig::n_random,
                    "Useless inputs besides: a new uniform number each time. Not in the paper.",
                    core::within(0, 100)));
  }
  bool operator==(const SensorConfig&) const = default;
};

/// Sensors that observe, in this order, s1..s4, s5 and s6 if configured, constant inputs of 1/2,
/// and random inputs.
///
/// Source: the paper's sections on the acrobot task and on noisy and redundant inputs. The useless
/// inputs, constant and random, are not in the paper.
class AcrobotSensors {
 public:
  /// Makes sensors whose noise has the random stream `stream` of the seed. Throws
  /// std::invalid_argument if a number is outside its range.
  AcrobotSensors(const SensorConfig& config, std::uint64_t seed, core::Stream stream)
      : n_sensors_(checked("n_sensors", config.n_sensors, kBasic, kBasic + 2)),
        n_constant_(checked("n_constant", config.n_constant, 0, kMaxUseless)),
        n_random_(checked("n_random", config.n_random, 0, kMaxUseless)),
        noise_entry_(config.noise_entry),
        noise_(config.noise, edges(config), seed, stream),
        random_(seed, core::Stream::useless_inputs, static_cast<std::uint64_t>(stream)) {}

  /// Writes an observation of `state`. Shape: out (n_inputs,); every entry is in [0, 1].
  void observe(const AcrobotState& state, std::span<double> out) noexcept {
    assert(out.size() == n_inputs());
    const Eigen::Vector4d basic = basic_observation(state);
    std::copy(basic.begin(), basic.end(), out.begin());
    const std::span<double> noisy = out.first(noise_.n_channels());
    if (noise_entry_ == NoiseEntry::basic_sensors) noise_.apply(noisy);
    if (n_sensors_ > kBasic) out[kBasic] = energy_sensor(out[2], out[3]);
    if (n_sensors_ > kBasic + 1) out[kBasic + 1] = height_sensor(out[0], out[1]);
    std::ranges::fill(out.subspan(n_sensors_, n_constant_), 0.5);
    if (noise_entry_ == NoiseEntry::every_sensor) noise_.apply(noisy);
    for (double& value : out.last(n_random_)) value = random_.uniform();
  }

  /// The number of variables in an observation.
  std::size_t n_inputs() const noexcept { return n_sensors_ + n_constant_ + n_random_; }

 private:
  static constexpr int kBasic = 4;
  static constexpr int kMaxUseless = 100;

  static std::size_t checked(std::string_view name, int value, int low, int high) {
    core::require_in_range(name, value, low, high);
    return static_cast<std::size_t>(value);
  }

  /// Returns the treatment of noise for each noisy input of a checked configuration.
  static std::vector<SensorEdge> edges(const SensorConfig& config) {
    const int n_noisy = config.noise_entry == NoiseEntry::basic_sensors
                            ? kBasic
                            : config.n_sensors + config.n_constant;
    std::vector<SensorEdge> result(static_cast<std::size_t>(n_noisy), SensorEdge::saturate);
    result[0] = result[1] = SensorEdge::wrap;
    return result;
  }

  std::size_t n_sensors_;
  std::size_t n_constant_;
  std::size_t n_random_;
  NoiseEntry noise_entry_;
  SensorNoise noise_;
  core::Random random_;
};

}  // namespace sdnn::environments
