#include "sdnn/core/detail/check.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "errors.hpp"
#include "states.hpp"

namespace {

using namespace sdnn::core;

using sdnn::testing::kInfinity;
using sdnn::testing::kNaN;
using sdnn::testing::message_of;

TEST(Require, StatesTheExpectedAndTheActualValue) {
  EXPECT_EQ(message_of([] { require(false, "n_bins", "even", 7); }), "n_bins must be even, got 7");
  EXPECT_EQ(message_of([] { require(true, "n_bins", "even", 8); }), "no error");
}

TEST(RequireInRange, AcceptsTheLimitsAndNothingBeyond) {
  EXPECT_NO_THROW(require_in_range("n", 1, 1, 900));
  EXPECT_NO_THROW(require_in_range("n", 900, 1, 900));
  EXPECT_EQ(message_of([] { require_in_range("n_active_units", 901, 1, 900); }),
            "n_active_units must be in [1, 900], got 901");
  EXPECT_THROW(require_in_range("n", 0, 1, 900), std::invalid_argument);
  EXPECT_THROW(require_in_range("x", kNaN, 0.0, 1.0), std::invalid_argument);
}

TEST(RequireFinite, RejectsNonFinite) {
  EXPECT_NO_THROW(require_finite("x", -1e308));
  for (const double bad : {kInfinity, -kInfinity, kNaN}) {
    EXPECT_THROW(require_finite("x", bad), std::invalid_argument) << bad;
  }
}

TEST(RequireUnitValues, NamesTheFirstBadValue) {
  const auto message = [](std::vector<double> values) {
    return message_of([&] { require_unit_values("state", values, 2); });
  };
  EXPECT_EQ(message({0.0, 1.0}), "no error");
  EXPECT_EQ(message({0.5}), "state must be 2 values, got 1");
  EXPECT_EQ(message({0.5, 1.5}), "state[1] must be in [0, 1], got 1.5");
  EXPECT_EQ(message({kNaN, 2.0}), "state[0] must be in [0, 1], got nan");
  EXPECT_EQ(message({0.5, -kInfinity}), "state[1] must be in [0, 1], got -inf");
}

}  // namespace
