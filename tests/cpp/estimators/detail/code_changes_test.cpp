#include "sdnn/estimators/detail/code_changes.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "estimators/codes.hpp"
#include "instruction_sets.hpp"

namespace sdnn {
namespace {

/// What the slots add to each slot of a code.
std::vector<int> entries_of(const estimators::SignedSlots& slots, std::size_t n_words) {
  std::vector<int> entries(64 * n_words);
  for (const std::uint32_t slot : slots.plus()) ++entries[slot];
  for (const std::uint32_t slot : slots.minus()) --entries[slot];
  return entries;
}

TEST(SignedSlots, LeadFromOneCodeToAnother) {
  core::Random random(5, core::Stream::weights);
  for (std::size_t n_words = 0; n_words < 9; ++n_words) {
    for (const std::size_t n_changes : {0U, 1U, 5U, 1000U}) {
      const auto from = testing::random_code(n_words, random);
      const auto to = n_words == 0 ? from : testing::neighbour_of(from, n_changes, random);
      std::vector<int> differences;
      std::size_t distance = 0;
      for (std::size_t slot = 0; slot < 64 * n_words; ++slot) {
        differences.push_back(to.at(slot) - from.at(slot));
        distance += static_cast<std::size_t>(std::abs(differences.back()));
      }
      testing::on_every_instruction_set([&](auto level) {
        estimators::SignedSlots slots(n_words);
        slots.read_changes(from.words(), to.words());
        EXPECT_EQ(entries_of(slots, n_words), differences) << level;
        EXPECT_EQ(slots.size(), distance);
      });
    }
  }
}

TEST(SignedSlots, HoldTheLongestLists) {
  const std::size_t n_words = 3;
  testing::Code up{std::vector<std::uint64_t>(n_words, ~std::uint64_t{0}),
                   std::vector<std::uint64_t>(n_words, ~std::uint64_t{0})};
  testing::Code down = up;
  down.positive.assign(n_words, 0);
  testing::on_every_instruction_set([&](auto level) {
    estimators::SignedSlots slots(n_words);
    slots.read_changes(down.words(), up.words());
    EXPECT_EQ(slots.plus().size(), 128 * n_words) << level;
    slots.read(down.words());
    EXPECT_EQ(slots.minus().size(), 64 * n_words) << level;
    EXPECT_TRUE(slots.plus().empty());
  });
}

}  // namespace
}  // namespace sdnn
