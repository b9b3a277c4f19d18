#include "sdnn/agents/observations.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "errors.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using Numbers = std::vector<double>;
using Ends = std::vector<std::optional<double>>;

ObservationConfig unbounded(std::size_t n) { return {.low = Ends(n), .high = Ends(n)}; }

Observations fitted(const ObservationConfig& config, const Numbers& observed,
                    bool codes_symbols = true) {
  Observations observations(config, codes_symbols, 1);
  observations.fit(observed);
  return observations;
}

Numbers low_of(const Observations& observations) {
  return {observations.low().begin(), observations.low().end()};
}
Numbers high_of(const Observations& observations) {
  return {observations.high().begin(), observations.high().end()};
}

std::vector<ObservedKind> kinds_of(const Observations& observations) {
  std::vector<ObservedKind> kinds;
  for (const ObservedInput& input : observations.inputs()) kinds.push_back(input.kind);
  return kinds;
}

std::string error_of(const ObservationConfig& config) {
  return testing::message_of([&] { const Observations observations(config, true, 1); });
}

TEST(Observations, AreFittedWithAQuarterOfTheirWidthMoreAtEachEnd) {
  // Two observations of three variables: 0 and 4, -5 and 5, and a constant of 7, whose size counts
  // as its width.
  const auto observations = fitted(unbounded(3), {0.0, -5.0, 7.0, 4.0, 5.0, 7.0});
  EXPECT_EQ(low_of(observations), (Numbers{-1.0, -7.5, 7.0 - 7.0 / 4}));
  EXPECT_EQ(high_of(observations), (Numbers{5.0, 7.5, 7.0 + 7.0 / 4}));
  const ObservationConfig half_known{.low = {{}, 0.0}, .high = {{}, 1.0}};
  EXPECT_EQ(low_of(fitted(half_known, {0.0, 0.4, 4.0, 0.6})), (Numbers{-1.0, 0.0}));
}

TEST(Observations, AdaptiveRangesExcludeRareValuesAndStayWithinFixedOnes) {
  const double pi = std::numbers::pi;
  const ObservationConfig config{.low = {-100.0, 0.0, 0.0, {}, -pi, -1.0},
                                 .high = {100.0, 4.0, 1.0, {}, pi, 1.0},
                                 .adaptive = true,
                                 .angles = {4}};
  Numbers observed;
  for (int t = 0; t < 40; ++t) {  // 2 of 40 at each end are rare
    const double part = static_cast<double>(t - 2) / 35.0;
    const bool is_first = t < 2, is_last = t > 37;
    observed.push_back(is_first ? -90.0 + t : is_last ? 70.0 + t : 2.0 + 4.0 * part);
    observed.push_back(0.1 * t);             // with a quarter more, beyond the fixed range
    observed.push_back(t == 0 ? 1.0 : 0.0);  // constant but for a rare value
    observed.push_back(is_first ? -1e9 : is_last ? 1e9 : 8.0 * part);
    observed.push_back(0.1);                 // an angle
    observed.push_back(t < 20 ? 0.0 : 3.0);  // beyond its bound of 1, which extends the range to 3
  }
  const auto observations = fitted(config, observed);
  // The ranges without rare values, 2 to 6 and 0 to 8, are extended by a quarter at each end.
  EXPECT_EQ(low_of(observations), (Numbers{1.0, 0.0, 0.0, -2.0, -pi, -0.75}));
  EXPECT_EQ(high_of(observations), (Numbers{7.0, 4.0, 1.0, 10.0, pi, 3.0}));
}

TEST(Observations, RangesMoreThanTwiceTooWideAreNarrowedForUpToFourInputs) {
  const auto range = [](double low, double high, Numbers observed, std::size_t n_variables = 1) {
    ObservationConfig config{.narrowed = true};
    config.low.assign(n_variables, low);
    config.high.assign(n_variables, high);
    Numbers rows;
    for (const double x : observed) rows.insert(rows.end(), n_variables, x);
    const auto observations = fitted(config, rows);
    return std::pair(observations.low().front(), observations.high().front());
  };
  // Observations of 0 to 4 have a fitted range of -1 to 5, of a width of 6.
  EXPECT_EQ(range(-6.0, 6.0, {0.0, 4.0}), std::pair(-6.0, 6.0));
  EXPECT_EQ(range(-6.0, 6.1, {0.0, 4.0}), std::pair(-1.0, 5.0));
  EXPECT_EQ(range(0.0, 100.0, {0.0, 4.0}), std::pair(0.0, 5.0));
  EXPECT_EQ(range(-100.0, 100.0, {4.0, 4.0}), std::pair(-100.0, 100.0));  // a constant
  // Observations that differ by rounding only, and an observation beyond the range.
  EXPECT_EQ(range(-1.0, 1.0, {0.5, 0.5F + 0x1p-24F}), std::pair(-1.0, 1.0));
  EXPECT_EQ(range(-100.0, 3.0, {0.0, 4.0}), std::pair(-100.0, 3.0));
  EXPECT_EQ(range(-100.0, 100.0, {0.0, 4.0}, 4), std::pair(-1.0, 5.0));
  EXPECT_EQ(range(-100.0, 100.0, {0.0, 4.0}, 5), std::pair(-100.0, 100.0));
}

// An angle, its cosine, sine and cosine: variables 1 and 2 are a pair, if they move.
TEST(Observations, FindPairsOnACircleAsAngles) {
  ObservationConfig config{.low = Ends(4, -10.0), .high = Ends(4, 10.0), .find_angle_pairs = true};
  Numbers observed, motionless;
  for (int t = 0; t < 40; ++t) {
    const double angle = 5.0 * t / 39.0;
    for (const double x : {angle, std::cos(angle), std::sin(angle), std::cos(angle)}) {
      observed.push_back(x);
    }
    for (const double x : {1.0, 0.0, 1.0, 0.0}) motionless.push_back(x);
  }
  const auto observations = fitted(config, observed);
  EXPECT_EQ(kinds_of(observations),
            (std::vector{ObservedKind::variable, ObservedKind::angle, ObservedKind::variable}));
  EXPECT_EQ(observations.circular(), (std::vector<bool>{false, true, false}));
  EXPECT_EQ(low_of(observations), (Numbers{-10.0, -1.0, -1.0, -10.0}));
  EXPECT_EQ(fitted(config, motionless).n_inputs(), 4U);
  config.angles = {2};  // is no part of a pair then
  EXPECT_EQ(fitted(config, observed).n_inputs(), 4U);
}

TEST(Observations, CodeSymbolsAsOneInputOrAsVariables) {
  const ObservationConfig config{.low = {0.0, 0.0, -2.0, 0.0, 0.0},
                                 .high = {1.0, 1.0, 2.0, 1.0, 1.0},
                                 .adaptive = false,
                                 .symbols = {{0, 2}, {3, 2}}};
  const Observations coded(config, true, 1), plain(config, false, 1);
  EXPECT_EQ(coded.n_symbols(), (std::vector<int>{2, 0, 2}));
  EXPECT_EQ(plain.n_inputs(), 5U);
  ObservationConfig adaptive = config;
  adaptive.adaptive = true;  // symbols have no range to adapt
  EXPECT_EQ(fitted(adaptive, Numbers(10, 0.5)).n_symbols(), coded.n_symbols());
  const Observations lone({.low = Ends(2, 0.0), .high = Ends(2, 1.0), .symbols = {{0, 2}}}, true,
                          2);
  EXPECT_EQ(lone.n_symbols(), (std::vector<int>{2, 2}));  // repeated, as two are needed
}

/// An angle that wanders as its cosine and sine, with noise, and a radius that does or does not.
Numbers wandering(double noise, double radius_moves) {
  core::Random random(3, core::Stream::sensor_noise);
  Numbers path;
  double angle = 0.0;
  for (int t = 0; t <= 600; ++t) {
    angle += 0.3 * random.normal();
    const double radius = 1.0 + radius_moves * std::sin(0.05 * t);
    path.push_back(radius * std::cos(angle) + noise * random.normal());
    path.push_back(radius * std::sin(angle) + noise * random.normal());
  }
  Numbers observed(path.begin(), path.end() - 2);  // observations, then the next ones
  observed.insert(observed.end(), path.begin() + 2, path.end());
  return observed;
}

// wandering(noise, radius_moves) is a path of the cosine and sine of a moving angle, which are one
// input if they are found to be on a circle, else two.
TEST(Observations, FindNoisyAnglesButNotPositions) {
  ObservationConfig config = unbounded(2);
  config.find_angle_pairs = true;
  const auto n_inputs = [&config](const Numbers& observed) {
    return fitted(config, observed).n_inputs();
  };
  EXPECT_EQ(n_inputs(wandering(0.0, 0.0)), 1U);
  EXPECT_EQ(n_inputs(wandering(0.1, 0.0)), 1U);
  EXPECT_EQ(n_inputs(wandering(0.2, 0.0)), 1U);
  EXPECT_EQ(n_inputs(wandering(0.6, 0.0)), 2U);  // noise hides the circle
  EXPECT_EQ(n_inputs(wandering(0.1, 0.3)), 2U);  // the radius moves, too
  Numbers few = wandering(0.1, 0.0);
  few.resize(200);
  EXPECT_EQ(n_inputs(few), 2U);  // 100 observations of two variables are too few
}

TEST(Observations, AppendInputsThatAreAddedLaterAndRestoreThem) {
  ObservationConfig config = unbounded(5);
  config.relevant_only = true;
  Observations first(config, true, 1), second = first;
  first.fit(Numbers{0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0});
  EXPECT_EQ(first.n_first_inputs(), 5U);
  first.keep({false, true, false, true, false});
  EXPECT_EQ(first.n_first_inputs(), 2U);
  first.keep({true, true, false, true, true});
  const auto variables = [](const Observations& observations) {
    std::vector<std::size_t> variables;
    for (const ObservedInput& input : observations.inputs()) variables.push_back(input.first);
    return variables;
  };
  EXPECT_EQ(variables(first), (std::vector<std::size_t>{1, 3, 0, 4}));
  EXPECT_EQ(first.n_first_inputs(), 2U);
  EXPECT_EQ(first.kept_inputs(), (std::vector<bool>{true, true, false, true, true}));
  EXPECT_EQ(variables(first.with_all_inputs()), (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  const auto good = core::state_of(first);
  core::restore(second, good);
  EXPECT_EQ(variables(second), variables(first));
  EXPECT_EQ(second.n_first_inputs(), 2U);
  // The first of the kept inputs 1, 3, 0, 4 of five: no input, one of the others, beyond the last.
  for (const std::int32_t bad : {-1, 3, 5}) {
    testing::expect_refused(first, testing::with_number(good, "kept", bad), "state: kept");
  }
  for (const std::uint64_t bad : {0U, 5U}) {  // there are four kept inputs
    testing::expect_refused(first, testing::with_number(good, "n_first", bad), "state: n_first");
  }
  testing::expect_refused(first, testing::with_number<std::int32_t>(good, "kept", 4),
                          "state: kept");  // not in order
}

TEST(Observations, RefuseBadConfigurationsByTheirField) {
  const ObservationConfig good{.low = Ends(3, 0.0), .high = Ends(3, 1.0), .symbols = {{1, 2}}};
  EXPECT_EQ(error_of(good), "no error");
  const auto expect_error_naming = [&good](const char* name, auto change) {
    ObservationConfig bad = good;
    change(bad);
    EXPECT_NE(error_of(bad).find(name), std::string::npos) << error_of(bad);
  };
  expect_error_naming("observation.low", [](auto& bad) { bad = {}; });
  expect_error_naming("observation.high", [](auto& bad) { bad.high.pop_back(); });
  expect_error_naming("observation.high", [](auto& bad) { bad.high[0] = -1.0; });
  expect_error_naming("angles", [](auto& bad) { bad.angles = {3}; });
  expect_error_naming("angles", [](auto& bad) { bad.angles = {-1}; });
  expect_error_naming("angles", [](auto& bad) { bad.angles = {2}; });  // a variable of the symbol
  expect_error_naming("angles", [](auto& bad) { bad.angles = {0, 0}; });
  expect_error_naming("angles", [](auto& bad) {
    bad.angles = {0};
    bad.high[0] = std::nullopt;
  });
  expect_error_naming("angle_pairs", [](auto& bad) { bad.angle_pairs = {{0, 3}}; });
  expect_error_naming("angle_pairs", [](auto& bad) { bad.angle_pairs = {{0}}; });
  expect_error_naming("symbols", [](auto& bad) { bad.symbols = {{2, 2}}; });
  expect_error_naming("symbols", [](auto& bad) { bad.symbols = {{0, 2}, {1, 2}}; });
}

}  // namespace
}  // namespace sdnn::agents
