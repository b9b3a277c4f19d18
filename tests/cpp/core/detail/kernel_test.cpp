#include "sdnn/core/detail/kernel.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "instruction_sets.hpp"

namespace sdnn::core::kernel_test {

namespace detail {

SDNN_INLINE int sum_body(const int* items, int n) noexcept {
  int sum = 0;
  for (int i = 0; i < n; ++i) sum += items[i];
  return sum;
}

// Every version of this kernel is written by hand and returns its name, to show which one runs.
inline std::string_view version_portable() { return "portable"; }
inline std::string_view version_neon() { return "neon"; }
inline std::string_view version_avx2() { return "avx2"; }
inline std::string_view version_avx512() { return "avx512"; }

SDNN_INLINE std::string_view mixed_body() { return "generated"; }
inline std::string_view mixed_neon() { return "by hand"; }
inline std::string_view mixed_avx2() { return "by hand"; }

}  // namespace detail

SDNN_KERNEL(int, sum, (const int* items, int n), (items, n))
SDNN_DISPATCH(std::string_view, version, (), ())

SDNN_KERNEL_PORTABLE(std::string_view, mixed, (), ())
SDNN_KERNEL_AVX512(std::string_view, mixed, (), ())
SDNN_DISPATCH(std::string_view, mixed, (), ())

namespace {

TEST(Kernel, GivesTheSameResultOnEveryInstructionSet) {
  const int items[] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  sdnn::testing::on_every_instruction_set(
      [&](auto level) { EXPECT_EQ(sum(items, 9), 45) << level; });
}

TEST(Kernel, RunsTheVersionOfTheSelectedInstructionSet) {
  sdnn::testing::on_every_instruction_set([](auto level) { EXPECT_EQ(version(), level); });
}

// A version for NEON and for AVX2 is written by hand; the others are compiled from the body.
TEST(Kernel, PrefersHandWrittenVersions) {
  sdnn::testing::on_every_instruction_set([](auto level) {
    EXPECT_EQ(mixed(), level == "avx2" || level == "neon" ? "by hand" : "generated") << level;
  });
}

}  // namespace
}  // namespace sdnn::core::kernel_test
