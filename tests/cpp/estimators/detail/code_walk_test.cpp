#include "sdnn/estimators/detail/code_walk.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "estimators/codes.hpp"
#include "instruction_sets.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"

namespace sdnn {
namespace {

using estimators::ChunkCode;
using estimators::ChunkedWeights;
using estimators::CodeWalk;
using estimators::kChunkColumns;
using estimators::kChunkWords;
using estimators::WeightTiles;

/// Eight codes: six differ from the one before in up to 9 slots, the last one in about half of
/// them.
std::vector<testing::Code> neighbours_and_a_distant_code(std::size_t n_words,
                                                         core::Random& random) {
  std::vector<testing::Code> codes{testing::random_code(n_words, random)};
  for (int k = 0; k < 6; ++k) codes.push_back(testing::neighbour_of(codes.back(), 9, random));
  codes.push_back(testing::random_code(n_words, random));
  return codes;
}

CodeWalk walk_through(const std::vector<testing::Code>& codes, std::size_t n_words) {
  std::vector<ChunkCode> words(codes.size());
  for (std::size_t k = 0; k < codes.size(); ++k) {
    std::copy_n(codes[k].words().active, n_words, words[k].active);
    std::copy_n(codes[k].words().positive, n_words, words[k].positive);
  }
  CodeWalk walk;
  walk.steps.resize(codes.size());
  walk.columns.resize(64 * n_words * codes.size() + 2);  // list_steps may write 2 more
  const auto* const end =
      estimators::list_steps(words, n_words, walk.columns.data(), walk.steps.data());
  walk.columns.resize(static_cast<std::size_t>(end - walk.columns.data()));
  return walk;
}

/// Expects exact sums over codes of random weights in [-largest, largest]. A walk computes the sums
/// of a code from those of the code before it.
template <class Weight>
void expect_exact_walk_sums(std::int32_t largest) {
  core::Random random(8, core::Stream::weights);
  // Potential k is the start plus the sums of the codes first[k] and second[k].
  constexpr std::int32_t kStart = 11;
  const std::vector<std::uint16_t> first{3, 2, 2, 0, 4, 5, 7, 6, 1, 7};
  const std::vector<std::uint16_t> second{0, 1, 2, 3, 4, 5, 6, 7, 7, 6};
  for (const std::size_t n_words : {std::size_t{1}, std::size_t{2}, kChunkWords}) {
    const auto codes = neighbours_and_a_distant_code(n_words, random);
    for (std::size_t width = 16; width <= estimators::kMostUnits<Weight>; width += 16) {
      core::AlignedBuffer<Weight> rows(kChunkColumns * width);
      for (auto& weight : rows.span()) {
        weight = static_cast<Weight>(
            static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(2 * largest + 1))) -
            largest);
      }
      const std::size_t stride = width + 3;  // the 3 potentials behind the width must not change
      testing::on_every_instruction_set([&](auto level) {
        const CodeWalk walk = walk_through(codes, n_words);
        std::vector<Weight> sums(codes.size() * width);
        estimators::sum_steps(rows.data(), width, walk, sums.data());
        const std::vector<estimators::StepSums<Weight>> added{{sums.data(), first.data()},
                                                              {sums.data(), second.data()}};
        std::vector<std::int32_t> potentials(first.size() * stride, kStart);
        estimators::add_step_sums(std::span(added), width, first.size(), potentials.data(), stride);
        for (std::size_t k = 0; k < first.size(); ++k) {
          for (std::size_t i = 0; i < stride; ++i) {
            std::int32_t expected = kStart;
            for (std::size_t c = 0; i < width && c < 64 * n_words; ++c) {
              expected += (codes[first[k]].at(c) + codes[second[k]].at(c)) * rows[c * width + i];
            }
            ASSERT_EQ(potentials[k * stride + i], expected) << level << ' ' << width << ' ' << k;
          }
        }
      });
    }
  }
}

TEST(CodeWalk, SumsOfStepsEqualSumsOfCodes) {
  expect_exact_walk_sums<std::int16_t>(63);  // 2 codes * 256 columns * 63 < 2^15
  expect_exact_walk_sums<std::int32_t>(1000000);
}

// A walk starts anew at a code that differs from the one before by more than its active columns.
TEST(CodeWalk, StartsDistantCodesFromZero) {
  core::Random random(9, core::Stream::weights);
  const CodeWalk walk =
      walk_through(neighbours_and_a_distant_code(kChunkWords, random), kChunkWords);
  EXPECT_FALSE(walk.steps[3].from_zero);  // a neighbour of the code before
  EXPECT_TRUE(walk.steps.back().from_zero);
}

TEST(ChunkedWeights, AreCopiesOfTilesPaddedWithZeros) {
  WeightTiles<std::int32_t> tiles(20, 3 * 64);
  tiles.at(17, 130) = -300;
  tiles.at(17, 131) = 40000;
  // Chunks have 4 words of 64 slots. Word 2 of the tiles has slots 128 to 191, and comes first in
  // the second chunk; word 3 comes second in the first chunk, but the tiles have only 3 words.
  const ChunkedWeights<std::int32_t> wide(tiles, {0, 3, 1, 4, 2, 5, 6, 7});
  EXPECT_EQ(wide.n_chunks(), 2U);
  EXPECT_EQ(wide.n_padded_units(), 32U);  // 20, to a multiple of 16
  EXPECT_EQ(wide.chunk(1, 17)[130 - 128], -300);
  EXPECT_EQ(wide.chunk(0, 17)[64], 0);
  EXPECT_EQ(wide.largest_chunk_norm(), 300 + 40000);
  EXPECT_EQ(ChunkedWeights<std::int32_t>::bytes(32, 4), sizeof(std::int32_t) * 32 * 4 * 64);
}

TEST(ChunkedWeights, KeepTilesThroughConversionToNarrowWeights) {
  WeightTiles<std::int32_t> tiles(200, 128);
  std::int32_t value = -10000;
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::size_t slot = 0; slot < 128; ++slot) tiles.at(i, slot) = ++value;
  }
  const std::vector<std::size_t> words{1, 0, 2, 3};
  const ChunkedWeights<std::int16_t> narrow(ChunkedWeights<std::int32_t>(tiles, words));
  WeightTiles<std::int32_t> back(200, 128);
  narrow.copy_to(back, words);
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::size_t slot = 0; slot < 128; ++slot) ASSERT_EQ(back.at(i, slot), tiles.at(i, slot));
  }
}

}  // namespace
}  // namespace sdnn
