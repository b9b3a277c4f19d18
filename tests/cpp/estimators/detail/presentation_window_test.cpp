#include "sdnn/estimators/detail/presentation_window.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn {
namespace {

/// Corrects the units whose potential is odd, upwards where it is negative, and keeps what it met.
struct OddRule {
  std::size_t n_units;
  std::vector<std::vector<std::int32_t>> met;

  void operator()(std::size_t /*sample*/, const std::int32_t* potentials,
                  std::vector<estimators::Correction>& corrections) {
    met.emplace_back(potentials, potentials + n_units);
    corrections.clear();
    for (std::uint32_t i = 0; i < n_units; ++i) {
      if (potentials[i] % 2 != 0) corrections.push_back({i, potentials[i] < 0 ? 1 : -1});
    }
  }
};

template <class Product>
void check_window() {
  constexpr std::size_t kUnits = 19;
  core::Random random(6, core::Stream::weights);
  for (const std::size_t size : {1U, 15U, 16U, 17U, 70U}) {
    const std::size_t stride = core::round_up(size, 16);
    std::vector<Product> products(size * stride);
    for (auto& product : products)
      product = static_cast<Product>(static_cast<int>(random.below(41)) - 20);
    std::vector<std::vector<std::int32_t>> start(size, std::vector<std::int32_t>(kUnits));
    for (auto& values : start) {
      for (auto& value : values) value = static_cast<std::int32_t>(random.below(9)) - 4;
    }
    auto expected = start;  // every correction at once
    OddRule plain{kUnits, {}};
    std::size_t n_corrections = 0;
    for (std::size_t b = 0; b < size; ++b) {
      std::vector<estimators::Correction> corrections;
      plain(b, expected[b].data(), corrections);
      n_corrections += corrections.size();
      for (const auto& correction : corrections) {
        for (std::size_t e = b + 1; e < size; ++e) {
          expected[e][correction.unit] += correction.direction * products[b * stride + e];
        }
      }
    }
    testing::on_every_instruction_set([&](auto level) {
      estimators::PresentationWindow window(32, 70);
      for (std::size_t i = 0; i < kUnits; ++i) {
        for (std::size_t b = 0; b < size; ++b) window.row(i)[b] = start[b][i];
      }
      std::vector<std::int32_t> samples(size);
      std::iota(samples.begin(), samples.end(), 100);
      OddRule rule{kUnits, {}};
      std::size_t n_noted = 0;
      const auto count = window.present(std::span<const std::int32_t>(samples), products.data(),
                                        stride, rule, [&](std::size_t b, estimators::Correction) {
                                          EXPECT_EQ(b + 1, rule.met.size());
                                          ++n_noted;
                                        });
      EXPECT_EQ(rule.met, plain.met) << level << ' ' << size;
      EXPECT_EQ(count.n_units, n_corrections);
      EXPECT_EQ(n_noted, n_corrections);
    });
  }
}

TEST(PresentationWindow, ShowsEverySampleAllEarlierCorrections) {
  check_window<std::int16_t>();
  check_window<std::int32_t>();
}

}  // namespace
}  // namespace sdnn
