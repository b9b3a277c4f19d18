#include "sdnn/estimators/unit_kernels.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sdnn/core/random.hpp"

namespace {

using namespace sdnn;

/// Calls check(kernels) for every instruction set of this processor.
template <class Check>
void on_every_level(const Check& check) {
  const std::string before(core::name_of(core::instruction_set()));
  for (const auto level : {core::InstructionSet::portable, core::InstructionSet::avx2,
                           core::InstructionSet::avx512}) {
    if (level > core::best_instruction_set()) continue;
    core::set_instruction_set(core::name_of(level));
    check(estimators::unit_kernels());
  }
  core::set_instruction_set(before);
}

template <class Weight>
void check_rows(std::int32_t largest, std::size_t n_per_sum) {
  core::Random random(1, core::Stream::weights);
  const auto span = static_cast<std::uint64_t>(2 * largest + 1);
  for (const std::size_t width : {16U, 32U, 48U, 64U}) {
    core::AlignedBuffer<Weight> tile(100 * width);
    for (auto& weight : tile.span()) {
      weight = static_cast<Weight>(static_cast<std::int32_t>(random.below(span)) - largest);
    }
    std::vector<std::uint32_t> plus(random.below(300));
    std::vector<std::uint32_t> minus(random.below(300));
    for (auto& row : plus) row = static_cast<std::uint32_t>(random.below(100));
    for (auto& row : minus) row = static_cast<std::uint32_t>(random.below(100));
    std::vector<std::int32_t> expected(width, 5);
    for (std::size_t i = 0; i < width; ++i) {
      for (const auto row : plus) expected[i] += tile[row * width + i];
      for (const auto row : minus) expected[i] -= tile[row * width + i];
    }
    on_every_level([&](const estimators::UnitKernels& kernels) {
      std::vector<std::int32_t> sums(width, 5);
      kernels.add_rows(tile.data(), width, plus.data(), plus.size(), minus.data(), minus.size(),
                       n_per_sum, sums.data());
      EXPECT_EQ(sums, expected) << width;
    });
  }
}

TEST(UnitKernels, AddRowsExactly) {
  check_rows<std::int16_t>(327, 100);
  check_rows<std::int16_t>(32767, 1);
  check_rows<std::int32_t>(100000, std::size_t{1} << 30);
}

TEST(UnitKernels, AddProductsExactly) {
  const std::vector<std::int16_t> one{1, -2, 3, 32767, -32768};
  const std::vector<std::int16_t> other{10, 20, 30, 40, 50};
  const std::int16_t* const plus[] = {one.data(), one.data()};
  const std::int16_t* const minus[] = {other.data()};
  on_every_level([&](const estimators::UnitKernels& kernels) {
    std::vector<std::int32_t> to{100, 100, 100, 100, 100};
    kernels.add_products(to.data(), to.size(), plus, 2, minus, 1);
    EXPECT_EQ(to, (std::vector<std::int32_t>{92, 76, 76, 65594, -65486}));
  });
}

TEST(UnitKernels, CountAndFindUnits) {
  core::Random random(2, core::Stream::weights);
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  for (std::size_t size = 0; size < 90; ++size) {
    std::vector<std::int32_t> potentials(size);
    for (auto& p : potentials) p = static_cast<std::int32_t>(random.below(9)) - 4;
    for (const bool firing : {false, true}) {
      std::vector<std::int32_t> expected(size);
      std::int32_t least = kNone;
      std::int32_t n_firing = 0;
      for (std::size_t i = 0; i < size; ++i) {
        n_firing += potentials[i] > 0 ? 1 : 0;
        expected[i] = (potentials[i] > 0) == firing ? std::abs(potentials[i]) : kNone;
        least = std::min(least, expected[i]);
      }
      const auto first = static_cast<std::size_t>(
          std::find(expected.begin(), expected.end(), least) - expected.begin());
      on_every_level([&](const estimators::UnitKernels& kernels) {
        EXPECT_EQ(kernels.count_firing(potentials.data(), size), n_firing);
        std::vector<std::int32_t> distances(size);
        EXPECT_EQ(kernels.distances(potentials.data(), size, firing, distances.data()), least);
        EXPECT_EQ(distances, expected);
        EXPECT_EQ(kernels.least(distances.data(), size), least);
        EXPECT_EQ(kernels.find(distances.data(), size, 0, least), first);
        EXPECT_EQ(kernels.find(distances.data(), size, 0, -5), size);
      });
    }
  }
}

TEST(UnitKernels, InnerProductsAndOuterSums) {
  core::Random random(3, core::Stream::weights);
  for (std::size_t n_words = 0; n_words < 70; ++n_words) {
    std::array<std::vector<std::uint64_t>, 4> codes;  // active, positive, twice
    for (auto& words : codes) words.resize(n_words);
    std::int32_t expected = 0;
    for (std::size_t w = 0; w < n_words; ++w) {
      for (std::size_t c = 0; c < 4; ++c) {
        codes[c][w] = n_words % 7 == 0 ? ~std::uint64_t{0} : random.bits();
      }
      if (n_words % 14 == 0) codes[3][w] = 0;  // all unlike
      codes[1][w] &= codes[0][w];
      codes[3][w] &= codes[2][w];
      for (int bit = 0; bit < 64; ++bit) {
        const auto sign = [&](std::size_t c) {
          return static_cast<int>(codes[c][w] >> bit & 1) *
                 (2 * static_cast<int>(codes[c + 1][w] >> bit & 1) - 1);
        };
        expected += sign(0) * sign(2);
      }
    }
    on_every_level([&](const estimators::UnitKernels& kernels) {
      EXPECT_EQ(kernels.inner_product(codes[0].data(), codes[1].data(), codes[2].data(),
                                      codes[3].data(), n_words),
                expected);
    });
  }
  const std::vector<std::int16_t> coefficients{1, -2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
  on_every_level([&](const estimators::UnitKernels& kernels) {
    std::vector<std::int32_t> rows(64 * 16);
    kernels.add_outer(rows.data(), 16, coefficients.data(), (std::uint64_t{1} << 63) | 1, 1);
    EXPECT_EQ(rows[1], -2);
    EXPECT_EQ(rows[63 * 16 + 1], 2);
    EXPECT_EQ(rows[63 * 16 + 15], -16);
    EXPECT_EQ(rows[16], 0);
  });
}

}  // namespace
