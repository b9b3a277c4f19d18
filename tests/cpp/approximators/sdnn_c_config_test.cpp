#include "sdnn/approximators/sdnn_c_config.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <tuple>

namespace sdnn::approximators {
namespace {

TEST(SDNNCConfig, TheDefaultsAreThePapers) {
  const SDNNCConfig config;
  EXPECT_EQ(config.n_pattern_units, 200);
  EXPECT_EQ((config.n_anchor_patterns - 1) * (config.n_interpolated + 1), 360);
  EXPECT_EQ(config.n_hidden_units - config.n_active_units + 1, 601);
  EXPECT_EQ(config.q_high, -config.q_low);
}

// Each listed field is a member of its own, and equality looks at all of them.
TEST(SDNNCConfig, EveryFieldMakesADifference) {
  std::size_t n_fields = 0;
  std::apply(
      [&](const auto&... field) {
        const auto check = [&](const auto& one) {
          SDNNCConfig changed;
          one.of(changed) = {};
          SDNNCConfig same = changed;
          EXPECT_EQ(changed, same) << one.name;
          if (one.of(SDNNCConfig{}) != one.of(changed)) {
            EXPECT_NE(changed, SDNNCConfig{}) << one.name;
            ++n_fields;
          }
        };
        (check(field), ...);
      },
      SDNNCConfig::fields());
  EXPECT_EQ(n_fields, 14U);  // five defaults are zero, empty or the first of their kind already
}

}  // namespace
}  // namespace sdnn::approximators
