#include "sdnn/approximators/fuzzy_rules.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "approximators/with_workspace.hpp"
#include "errors.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

FiredRules fire(const FuzzyRules& rules, const std::vector<double>& state) {
  FiredRules fired;
  rules.fire(state, fired);
  return fired;
}

TEST(FuzzyRules, TruthValuesAreAsWorkedByHand) {
  const FuzzyRules rules({.n_inputs = 2, .n_sets = 5, .n_actions = 3});
  EXPECT_EQ(rules.n_rules(), 25U);
  // 0.25 * 4 = 1: the centre of set 1. 0.8125 * 4 = 3.25: sets 3 and 4. Rules 5 * 1 + 3 and + 4.
  const FiredRules at_a_centre = fire(rules, {0.25, 0.8125});
  EXPECT_EQ(at_a_centre.rules, (std::vector<std::size_t>{8, 9}));
  EXPECT_EQ(at_a_centre.truth_values, (std::vector<double>{0.75, 0.25}));
  // 0.125 * 4 = 0.5: sets 0 and 1.
  const FiredRules between_centres = fire(rules, {0.125, 0.8125});
  EXPECT_EQ(between_centres.rules, (std::vector<std::size_t>{3, 8, 4, 9}));
  EXPECT_EQ(between_centres.truth_values, (std::vector<double>{0.375, 0.375, 0.125, 0.125}));
}

TEST(FuzzyRules, TruthValuesOfDifferentRulesSumToOne) {
  core::Random random(3, core::Stream::ties);
  for (const int d : {1, 2, 3, 4, 6}) {
    const FuzzyRules rules({.n_inputs = d, .n_sets = 2 + d, .n_actions = 2});
    for (int trial = 0; trial < 300; ++trial) {
      FiredRules fired = fire(rules, testing::random_state(rules.n_inputs(), random));
      EXPECT_EQ(fired.size(), rules.max_fired());
      double total = 0.0;
      for (const double truth : fired.truth_values) {
        EXPECT_GT(truth, 0.0);
        total += truth;
      }
      EXPECT_NEAR(total, 1.0, 1e-15 * d);
      std::sort(fired.rules.begin(), fired.rules.end());  // no rule fires twice
      EXPECT_EQ(std::adjacent_find(fired.rules.begin(), fired.rules.end()), fired.rules.end());
      EXPECT_LT(fired.rules.back(), rules.n_rules());
    }
  }
}

// A rule's truth value is the product over inputs of max(0, 1 - |x - centre| / spacing).
TEST(FuzzyRules, EqualProductsOfTrianglesOfAllRules) {
  const FuzzyRules rules({.n_inputs = 3, .n_sets = 4, .n_actions = 1});
  core::Random random(4, core::Stream::ties);
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<double> state = {random.uniform(), random.uniform(), random.uniform()};
    std::vector<double> truth(rules.n_rules(), 0.0);
    const FiredRules fired = fire(rules, state);
    for (std::size_t i = 0; i < fired.size(); ++i) truth[fired.rules[i]] = fired.truth_values[i];
    for (std::size_t rule = 0; rule < rules.n_rules(); ++rule) {
      const std::array<std::size_t, 3> sets = {rule / 16, rule / 4 % 4, rule % 4};
      double expected = 1.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const double distance = std::abs(state[i] - static_cast<double>(sets[i]) / 3.0);
        expected *= std::max(0.0, 1.0 - distance * 3.0);
      }
      EXPECT_NEAR(truth[rule], expected, 1e-15) << rule;
    }
  }
}

std::string size_error(const FuzzyRulesConfig& config) {
  return testing::message_of<std::length_error>([&] { FuzzyRules rules(config); });
}

// Each rule has 21 actions of 4 bytes.
TEST(FuzzyRules, RefuseLargeTablesBeforeTheyAllocateMemory) {
  EXPECT_EQ(
      size_error({.n_inputs = 9}),
      "n_sets or n_inputs must be smaller: a table of 9^9 = 387420489 rules needs 32543321076 "
      "bytes, but max_table_bytes is 1073741824");
  EXPECT_EQ(size_error({.n_inputs = 2, .max_table_bytes = 81 * 84 - 1}),
            "n_sets or n_inputs must be smaller: a table of 9^2 = 81 rules needs 6804 bytes, but "
            "max_table_bytes is 6803");
  EXPECT_EQ(size_error({.n_inputs = 2, .max_table_bytes = 81 * 84}), "no error");
}

TEST(FuzzyRules, RefuseBadStatesAndKeepTheRulesThatFiredLast) {
  const FuzzyRules rules({.n_inputs = 2});
  FiredRules fired = fire(rules, {0.3, 0.4});
  const auto before = fired.rules;
  for (const auto& bad : {std::vector<double>{0.5}, {0.5, 1.1}, {std::nan(""), 0.0}}) {
    EXPECT_THROW(rules.fire(bad, fired), std::invalid_argument);
    EXPECT_EQ(fired.rules, before);
  }
}

}  // namespace
}  // namespace sdnn::approximators
