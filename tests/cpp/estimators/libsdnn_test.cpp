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

// Microsoft's uniform_int_distribution draws again from the last incomplete multiple of 11, and
// takes the remainder of the others.
TEST(Libsdnn, WithTheMsvcLibraryNumbersAreRemainders) {
  LibsdnnRandom ours(kSeed, StandardLibrary::msvc);
  std::seed_seq sequence(kSeed.begin(), kSeed.end());
  std::mt19937 theirs(sequence);
  for (int i = 0; i < 1000; ++i) {
    const auto drawn = static_cast<std::uint32_t>(theirs());
    if (drawn >= 11U * 390451572U) continue;  // the largest multiple of 11 that fits in 32 bits
    ASSERT_EQ(ours.uniform(-5, 5), static_cast<std::int32_t>(drawn % 11) - 5);
  }
}

TEST(Libsdnn, RefusesBadArguments) {
  EXPECT_THROW(LibsdnnRandom({}, StandardLibrary::msvc), std::invalid_argument);
  EXPECT_EQ(estimators::standard_library_named("msvc"), StandardLibrary::msvc);
  EXPECT_EQ(estimators::standard_library_named("libstdc++"), StandardLibrary::libstdcxx);
  EXPECT_THROW(estimators::standard_library_named("libc++"), std::invalid_argument);
  LibsdnnRandom random(kSeed, StandardLibrary::msvc);
  // The numbers of units, of bins, and of units of each sign that flip from bin to bin.
  EXPECT_THROW(estimators::libsdnn_patterns({71, 3, 1}, random), std::invalid_argument);   // odd
  EXPECT_THROW(estimators::libsdnn_patterns({70, 3, 35}, random), std::invalid_argument);  // all
  // Weights from 5 to -5, and a pair of inputs 0 and 1 where there is one input only.
  EXPECT_THROW(estimators::libsdnn_weights(2, 3, 5, -5, random), std::invalid_argument);
  const std::vector<coding::RandomInverseConfig> inputs(1, {10, 3, 1});
  const std::vector<coding::InputPair> pairs{{0, 1}};
  EXPECT_THROW(estimators::libsdnn_tables(inputs, pairs, random), std::invalid_argument);
}

}  // namespace
