#include "sdnn/estimators/unit_kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
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
    kernels.add_products(to.data(), to.size(), plus, 2, minus, 1, 1);
    EXPECT_EQ(to, (std::vector<std::int32_t>{92, 76, 76, 65594, -65486}));
    kernels.add_products(to.data(), to.size(), plus, 0, minus, 1, 1);
    EXPECT_EQ(to, (std::vector<std::int32_t>{82, 56, 46, 65554, -65536}));
  });
}

TEST(UnitKernels, AddManyProductsExactly) {
  core::Random random(4, core::Stream::weights);
  for (const std::size_t size : {1U, 64U, 100U, 200U}) {
    std::vector<std::vector<std::int16_t>> rows(21, std::vector<std::int16_t>(size));
    std::vector<std::int32_t> expected(size, 3);
    std::vector<const std::int16_t*> plus;
    std::vector<const std::int16_t*> minus;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      for (auto& entry : rows[k]) entry = static_cast<std::int16_t>(random.below(4001));
      (k % 3 == 0 ? minus : plus).push_back(rows[k].data());
      for (std::size_t i = 0; i < size; ++i) expected[i] += k % 3 == 0 ? -rows[k][i] : rows[k][i];
    }
    on_every_level([&](const estimators::UnitKernels& kernels) {
      std::vector<std::int32_t> to(size, 3);
      kernels.add_products(to.data(), size, plus.data(), plus.size(), minus.data(), minus.size(), 8);
      EXPECT_EQ(to, expected) << size;
    });
  }
}

TEST(UnitKernels, CorrectRowsByTheSamplesAskedFor) {
  std::vector<std::int16_t> coefficients(32 * 16);
  for (std::size_t b = 0; b < 32; ++b) coefficients[b * 16 + 3] = static_cast<std::int16_t>(b + 1);
  const std::vector<std::uint32_t> plus{0b1011, 0, 1U << 31};
  const std::vector<std::uint32_t> minus{0b0100, 0b1, 0};
  on_every_level([&](const estimators::UnitKernels& kernels) {
    std::vector<std::int16_t> rows(3 * 16, 10);
    kernels.correct_rows(rows.data(), 16, 3, plus.data(), minus.data(), 0x80000006, coefficients.data());
    EXPECT_EQ(rows[3], 10 + 2 - 3);   // samples 1 and 2; 0 and 3 are masked
    EXPECT_EQ(rows[16 + 3], 10);
    EXPECT_EQ(rows[32 + 3], 10 + 32);
    EXPECT_EQ(rows[32 + 4], 10);
  });
}

TEST(UnitKernels, CountAndRankUnits) {
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
        expected[i] = std::min(std::abs(potentials[i]), 3) * 128 + static_cast<std::int32_t>(i);
      }
      auto sorted = expected;
      std::sort(sorted.begin(), sorted.end());
      sorted.push_back(kNone);
      on_every_level([&](const estimators::UnitKernels& kernels) {
        EXPECT_EQ(kernels.count_firing(potentials.data(), size), n_firing);
        std::vector<std::int32_t> keys(size);
        EXPECT_EQ(kernels.rank(potentials.data(), size, firing, 7, 3, keys.data()), sorted[0]);
        EXPECT_EQ(keys, expected);
        for (std::size_t k = 0; k + 1 < sorted.size() && sorted[k] != kNone; ++k) {
          EXPECT_EQ(kernels.least_above(keys.data(), size, sorted[k]), sorted[k + 1]);
        }
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
