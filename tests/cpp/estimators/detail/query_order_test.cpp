#include "sdnn/estimators/detail/query_order.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <vector>

#include "sdnn/core/random.hpp"

namespace {

using namespace sdnn;

TEST(QueryOrder, TheHilbertCurveVisitsEveryPointInStepsOfOne) {
  for (const auto& [n_axes, n_bits] : {std::pair{2, 4}, std::pair{3, 3}}) {
    const std::uint32_t side = 1U << n_bits;
    std::size_t n_points = 1;
    for (int i = 0; i < n_axes; ++i) n_points *= side;
    std::vector<std::vector<std::uint32_t>> point_at(n_points);
    for (std::size_t p = 0; p < n_points; ++p) {
      std::vector<std::uint32_t> point;  // the digits of p in base `side`
      for (std::size_t rest = p, i = 0; i < static_cast<std::size_t>(n_axes); ++i, rest /= side) {
        point.push_back(static_cast<std::uint32_t>(rest % side));
      }
      auto axes = point;
      const auto index = static_cast<std::size_t>(estimators::detail::hilbert_index(axes, n_bits));
      ASSERT_LT(index, n_points);
      ASSERT_TRUE(point_at[index].empty());
      point_at[index] = point;
    }
    for (std::size_t p = 1; p < n_points; ++p) {
      std::uint32_t steps = 0;
      for (std::size_t i = 0; i < point_at[p].size(); ++i) {
        steps += std::max(point_at[p][i], point_at[p - 1][i]) -
                 std::min(point_at[p][i], point_at[p - 1][i]);
      }
      EXPECT_EQ(steps, 1U) << p;
    }
  }
}

// Queries are ordered so that successive ones are near each other: the walk through them is short.
// A walk through a lattice, row by row, cannot become shorter. Each of 2500 random points has
// 500^2 / 2500 = 10^2 places to itself, so that steps of about 10 are possible; without an order
// nearly all are longer than 64 and count as that.
TEST(QueryOrder, KeepsTheOrderOfALatticeAndShortensThatOfRandomPoints) {
  std::vector<std::int32_t> lattice;
  for (std::int32_t x = 0; x < 30; ++x) {
    for (std::int32_t y = 0; y < 30; ++y) lattice.insert(lattice.end(), {x, y});
  }
  core::Random random(1, core::Stream::exploration);
  std::vector<std::int32_t> scattered;
  for (int i = 0; i < 5000; ++i) scattered.push_back(static_cast<std::int32_t>(random.below(500)));
  constexpr std::int32_t kCap = 64;  // longer steps count as this
  for (const auto& bins : {lattice, scattered}) {
    auto order = estimators::query_order(bins, 2);
    std::vector<std::uint32_t> unordered(order.size());
    std::iota(unordered.begin(), unordered.end(), 0U);
    const auto length = [&](const std::vector<std::uint32_t>& walk) {
      return estimators::detail::walk_length(bins, 2, walk, kCap);
    };
    const bool is_lattice = bins.size() == lattice.size();
    EXPECT_LE(length(order), is_lattice ? length(unordered) : length(unordered) / 4);
    std::sort(order.begin(), order.end());
    EXPECT_EQ(order, unordered);  // every query once
  }
}

TEST(QueryOrder, AcceptsFewQueriesAndManyInputs) {
  EXPECT_TRUE(estimators::query_order({}, 3).empty());
  core::Random random(1, core::Stream::exploration);
  std::vector<std::int32_t> bins(100 * 80);  // more inputs than the curve's 64 bits can order
  for (auto& bin : bins) bin = static_cast<std::int32_t>(random.below(1000));
  const auto order = estimators::query_order(bins, 80);
  EXPECT_EQ(std::set<std::uint32_t>(order.begin(), order.end()).size(), 100U);
}

}  // namespace
