#include "sdnn/estimators/detail/code_walk.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <vector>

#include "estimators/codes.hpp"
#include "instruction_sets.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"

namespace sdnn {
namespace {

using estimators::CodeWalk;
using estimators::kChunkColumns;
using estimators::kChunkWords;

std::vector<testing::Code> some_codes(std::size_t n_words, core::Random& random) {
  std::vector<testing::Code> codes{testing::random_code(n_words, random)};
  for (int k = 0; k < 6; ++k) codes.push_back(testing::neighbour_of(codes.back(), 9, random));
  codes.push_back(testing::random_code(n_words, random));  // too far to walk to
  return codes;
}

template <class Weight>
void check_walk(std::int32_t largest) {
  core::Random random(8, core::Stream::weights);
  for (const std::size_t n_words : {kChunkWords, 3 * kChunkWords}) {
    const auto codes = some_codes(n_words, random);
    const std::vector<std::uint32_t> order{3, 2, 1, 0, 4, 5, 7, 6};
    for (std::size_t width = 16; width <= estimators::kMostUnits<Weight>; width += 16) {
      core::AlignedBuffer<Weight> rows(kChunkColumns * width);
      for (auto& weight : rows.span()) {
        weight = static_cast<Weight>(
            static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(2 * largest + 1))) -
            largest);
      }
      const std::size_t stride = width + 3;
      testing::on_every_instruction_set([&](auto level) {
        const CodeWalk walk(order, n_words, [&](std::uint32_t k) { return codes[k].words(); });
        ASSERT_EQ(walk.n_chunks(), n_words / kChunkWords);
        for (std::size_t chunk = 0; chunk < walk.n_chunks(); ++chunk) {
          std::vector<std::int32_t> potentials(codes.size() * stride, 11);
          estimators::walk_chunk(rows.data(), width, walk.stops(), walk.changes(chunk),
                                 potentials.data(), stride);
          for (std::size_t k = 0; k < codes.size(); ++k) {
            for (std::size_t i = 0; i < stride; ++i) {
              std::int32_t expected = 11;
              for (std::size_t c = 0; i < width && c < kChunkColumns; ++c) {
                expected += codes[k].at(chunk * kChunkColumns + c) * rows[c * width + i];
              }
              ASSERT_EQ(potentials[k * stride + i], expected) << level << ' ' << width << ' ' << k;
            }
          }
        }
      });
    }
  }
}

TEST(CodeWalk, SumsWhatEachCodeAsksFor) {
  check_walk<std::int16_t>(255);  // 128 columns of 255 just fit
  check_walk<std::int32_t>(1000000);
}

TEST(CodeWalk, StartsAfreshWhereThatIsNearer) {
  core::Random random(9, core::Stream::weights);
  const auto codes = some_codes(4 * kChunkWords, random);
  std::vector<std::uint32_t> order(codes.size());
  std::iota(order.begin(), order.end(), 0U);
  const CodeWalk walk(order, 4 * kChunkWords, [&](std::uint32_t k) { return codes[k].words(); });
  EXPECT_FALSE(walk.stops()[3].afresh);
  EXPECT_TRUE(walk.stops().back().afresh);
}

TEST(CodeWalk, ExpandsCodes) {
  core::Random random(10, core::Stream::weights);
  const auto code = testing::random_code(2 * kChunkWords, random);
  testing::on_every_instruction_set([&](auto level) {
    const std::size_t stride = 3 * kChunkColumns;
    std::vector<std::int8_t> entries(2 * stride, 7);
    estimators::expand_code(code.words(), 2 * kChunkWords, entries.data(), stride);
    for (std::size_t slot = 0; slot < 2 * kChunkColumns; ++slot) {
      ASSERT_EQ(entries[slot / kChunkColumns * stride + slot % kChunkColumns], code.at(slot))
          << level;
    }
    EXPECT_EQ(entries[kChunkColumns], 7);
  });
}

}  // namespace
}  // namespace sdnn
