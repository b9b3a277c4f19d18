#include "sdnn/approximators/detail/window_counts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

// Any number of units and actions; every third time all units fire, or none does.
TEST(WindowCounts, EqualPlainCounts) {
  core::Random random(1, core::Stream::weights);
  for (int n_units = 1; n_units < 1000; n_units += n_units < 40 ? 1 : 53) {
    const int size = 1 + static_cast<int>(random.below(static_cast<std::uint64_t>(n_units)));
    const int n_windows = n_units - size + 1;
    for (const int n_actions : {0, (n_windows + 1) / 2, n_windows}) {
      const coding::ActionCode actions(n_units, size, n_actions);
      std::vector<std::int32_t> potentials(static_cast<std::size_t>(n_units));
      const auto kind = random.below(6);
      for (auto& h : potentials) {
        h = kind < 2 ? static_cast<std::int32_t>(kind)
                     : static_cast<std::int32_t>(random.below(5)) - 2;
      }
      std::vector<std::int32_t> expected;
      for (std::size_t action = 0; action < actions.n_actions(); ++action) {
        const auto first =
            potentials.begin() + static_cast<std::ptrdiff_t>(actions.first_unit(action));
        expected.push_back(static_cast<std::int32_t>(
            std::count_if(first, first + size, [](auto h) { return h > 0; })));
      }
      WindowCounts counts(actions);
      sdnn::testing::on_every_instruction_set([&](auto level) {
        counts.count(potentials, actions);
        ASSERT_TRUE(std::ranges::equal(counts.of_actions(), expected)) << level;
        ASSERT_EQ(counts.largest(), *std::ranges::max_element(expected)) << level;
      });
    }
  }
}

}  // namespace
}  // namespace sdnn::approximators
