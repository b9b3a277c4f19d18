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

using estimators::ChunkedWeights;
using estimators::CodeWalk;
using estimators::kChunkColumns;
using estimators::kChunkWords;
using estimators::WeightTiles;

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
          estimators::walk_chunk(rows.data(), width, walk.steps(), walk.changes(chunk),
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

TEST(CodeWalk, StartsFromZeroWhereThatIsNearer) {
  core::Random random(9, core::Stream::weights);
  const auto codes = some_codes(4 * kChunkWords, random);
  std::vector<std::uint32_t> order(codes.size());
  std::iota(order.begin(), order.end(), 0U);
  const CodeWalk walk(order, 4 * kChunkWords, [&](std::uint32_t k) { return codes[k].words(); });
  EXPECT_FALSE(walk.steps()[3].from_zero);
  EXPECT_TRUE(walk.steps().back().from_zero);
}

TEST(ChunkedWeights, HoldTheTilesAndZerosBeyond) {
  WeightTiles<std::int32_t> tiles(20, 3 * 64);
  tiles.at(17, 130) = -300;
  tiles.at(17, 131) = 40000;
  const ChunkedWeights<std::int32_t> wide(tiles, 4);
  EXPECT_EQ(wide.n_chunks(), 2U);
  EXPECT_EQ(wide.n_padded_units(), 32U);
  EXPECT_EQ(wide.chunk(1, 17)[130 - kChunkColumns], -300);
  EXPECT_EQ(wide.chunk(1, 17)[127], 0);
  EXPECT_EQ(wide.largest_chunk_norm(), 40300);
  EXPECT_EQ(ChunkedWeights<std::int32_t>::bytes(32, 4), 4U * 32 * 256);
}

TEST(ChunkedWeights, GoThereAndBack) {
  WeightTiles<std::int32_t> tiles(200, 128);
  std::int32_t value = -10000;
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::size_t slot = 0; slot < 128; ++slot) tiles.at(i, slot) = ++value;
  }
  const ChunkedWeights<std::int16_t> narrow(ChunkedWeights<std::int32_t>(tiles, 2));
  WeightTiles<std::int32_t> back(200, 128);
  narrow.copy_to(back);
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::size_t slot = 0; slot < 128; ++slot) ASSERT_EQ(back.at(i, slot), tiles.at(i, slot));
  }
}

}  // namespace
}  // namespace sdnn
