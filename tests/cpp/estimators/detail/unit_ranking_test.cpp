#include "sdnn/estimators/detail/unit_ranking.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn {
namespace {

// A key has a unit's distance to the threshold in its high bits and the unit's index in its low
// ones; units that do not fire, or that do, have none.
TEST(UnitRanking, CountsFiringUnitsAndRanksUnitsByDistanceThenIndex) {
  constexpr int kIndexBits = 7;          // for fewer than 128 units
  constexpr std::int32_t kFarthest = 3;  // larger distances to the threshold count as this
  core::Random random(2, core::Stream::weights);
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  for (std::size_t size = 0; size < 90; ++size) {
    std::vector<std::int32_t> potentials(size);
    for (auto& p : potentials) p = static_cast<std::int32_t>(random.below(9)) - 4;
    for (const bool firing : {false, true}) {
      std::vector<std::int32_t> expected(size, kNone);
      std::int32_t n_firing = 0;
      for (std::size_t i = 0; i < size; ++i) {
        n_firing += potentials[i] > 0 ? 1 : 0;
        if ((potentials[i] > 0) != firing) continue;
        const std::int32_t distance = std::min(std::abs(potentials[i]), kFarthest);
        expected[i] = (distance << kIndexBits) + static_cast<std::int32_t>(i);
      }
      auto sorted = expected;
      std::sort(sorted.begin(), sorted.end());
      sorted.push_back(kNone);
      testing::on_every_instruction_set([&](auto level) {
        EXPECT_EQ(estimators::count_firing(potentials.data(), size), n_firing) << level;
        std::vector<std::int32_t> keys(size);
        EXPECT_EQ(estimators::rank_units(potentials.data(), size, firing, kIndexBits, kFarthest,
                                         keys.data()),
                  sorted[0]);
        EXPECT_EQ(keys, expected);
        for (std::size_t k = 0; k + 1 < sorted.size() && sorted[k] != kNone; ++k) {
          EXPECT_EQ(estimators::least_above(keys.data(), size, sorted[k]), sorted[k + 1]);
        }
      });
    }
  }
}

}  // namespace
}  // namespace sdnn
