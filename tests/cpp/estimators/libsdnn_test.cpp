#include "sdnn/estimators/libsdnn.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <vector>

namespace {

using namespace sdnn;
using estimators::LibsdnnRandom;
using estimators::StandardLibrary;

constexpr std::array<std::uint32_t, 1> kSeed{1};

TEST(Libsdnn, ColumnsAreReversedInGroupsOf32) {
  EXPECT_EQ(estimators::detail::libsdnn_column(0, 70), 31U);
  EXPECT_EQ(estimators::detail::libsdnn_column(31, 70), 0U);
  EXPECT_EQ(estimators::detail::libsdnn_column(32, 70), 63U);
  EXPECT_EQ(estimators::detail::libsdnn_column(64, 70), 69U);
  EXPECT_EQ(estimators::detail::libsdnn_column(69, 70), 64U);
  EXPECT_EQ(estimators::detail::libsdnn_column(0, 64), 31U);
}

#if defined(__GLIBCXX__) && defined(_GLIBCXX_RELEASE) && _GLIBCXX_RELEASE >= 11
TEST(Libsdnn, DrawsWhatTheStandardLibraryDraws) {
  LibsdnnRandom ours(kSeed, StandardLibrary::libstdcxx);
  std::seed_seq sequence(kSeed.begin(), kSeed.end());
  std::mt19937 theirs(sequence);
  for (const int high : {1, 6, 1999, 1 << 30}) {
    std::uniform_int_distribution<int> uniform(-1, high);
    for (int i = 0; i < 1000; ++i) ASSERT_EQ(ours.uniform(-1, high), uniform(theirs));
  }
}
#endif

TEST(Libsdnn, TheOtherLibraryTakesRemainders) {
  LibsdnnRandom ours(kSeed, StandardLibrary::msvc);
  std::seed_seq sequence(kSeed.begin(), kSeed.end());
  std::mt19937 theirs(sequence);
  for (int i = 0; i < 1000; ++i) {
    const auto drawn = static_cast<std::uint32_t>(theirs());
    if (drawn >= 4294967292U) continue;  // 11 * 390451572: the rest is rejected
    ASSERT_EQ(ours.uniform(-5, 5), static_cast<std::int32_t>(drawn % 11) - 5);
  }
}

TEST(Libsdnn, PatternsAreBalancedChains) {
  for (const auto library : {StandardLibrary::libstdcxx, StandardLibrary::msvc}) {
    LibsdnnRandom random(kSeed, library);
    const auto table = estimators::libsdnn_patterns({70, 30, 4}, random);
    for (std::size_t bin = 0; bin < 30; ++bin) {
      int n_on = 0;
      int n_unlike = 0;
      for (std::size_t k = 0; k < 70; ++k) {
        n_on += table.sign(bin, k) > 0 ? 1 : 0;
        n_unlike += bin > 0 && table.sign(bin, k) != table.sign(bin - 1, k) ? 1 : 0;
      }
      EXPECT_EQ(n_on, 35);
      EXPECT_EQ(n_unlike, bin > 0 ? 8 : 0);
    }
  }
}

TEST(Libsdnn, RefusesBadArguments) {
  EXPECT_THROW(LibsdnnRandom({}, StandardLibrary::msvc), std::invalid_argument);
  EXPECT_EQ(estimators::standard_library_named("msvc"), StandardLibrary::msvc);
  EXPECT_EQ(estimators::standard_library_named("libstdc++"), StandardLibrary::libstdcxx);
  EXPECT_THROW(estimators::standard_library_named("libc++"), std::invalid_argument);
  LibsdnnRandom random(kSeed, StandardLibrary::msvc);
  EXPECT_THROW(estimators::libsdnn_patterns({71, 3, 1}, random), std::invalid_argument);
  EXPECT_THROW(estimators::libsdnn_patterns({70, 3, 35}, random), std::invalid_argument);
  EXPECT_THROW(estimators::libsdnn_weights(2, 3, 5, -5, random), std::invalid_argument);
  const std::vector<coding::RandomInverseConfig> inputs(1, {10, 3, 1});
  const std::vector<coding::InputPair> pairs{{0, 1}};
  EXPECT_THROW(estimators::libsdnn_tables(inputs, pairs, random), std::invalid_argument);
}

}  // namespace
