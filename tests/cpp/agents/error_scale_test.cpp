#include "sdnn/agents/detail/error_scale.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "sdnn/core/random.hpp"

namespace sdnn::agents::detail {
namespace {

constexpr double kOne = 4096.0;  // normalized errors are integers, in units of 1 / 4096

TEST(SquareRoot, IsRoundedDownToAnInteger) {
  for (const std::uint64_t root : {0ULL, 1ULL, 2ULL, 3ULL, 1000ULL, 4294967295ULL}) {
    EXPECT_EQ(square_root(root * root), root);
    if (root > 0) {
      EXPECT_EQ(square_root(root * root - 1), root - 1);
    }
  }
}

// normalized(error, exponent) takes errors in units of 2^exponent, of the standard deviation 2^-2.
// It divides them by the root mean square of the errors so far, which the first 2,000 make precise.
TEST(ErrorScale, NormalizesErrorsToARootMeanSquareOfOne) {
  core::Random random(1, core::Stream::weights);
  ErrorScale scale;
  double sum = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double error = 0x1p28 * random.normal();
    const double normalized = scale.normalized(std::llround(error), -30) / kOne;
    EXPECT_LE(std::abs(normalized), 3.0);  // larger ones are clipped
    if (i >= 2000) sum += normalized * normalized;
  }
  EXPECT_NEAR(sum / 2000, 1.0, 0.1);
}

// An error is divided by the root mean square of all errors so far, itself included.
TEST(ErrorScale, NormalizesTheFirstErrorToPlusOrMinusOne) {
  for (const std::int64_t error : {std::int64_t{1} << 28, -(std::int64_t{1} << 20)}) {
    ErrorScale scale;
    EXPECT_NEAR(scale.normalized(error, 0) / kOne, error > 0 ? 1.0 : -1.0, 1e-3);
  }
}

TEST(ErrorScale, DoesNotDependOnTheUnit) {
  ErrorScale scale, coarser_scale;  // the unit of the second doubles every ten errors
  const int rounding = 3;           // in units of 1 / 4096
  for (int i = 0; i < 50; ++i) {
    const std::int64_t error = (std::int64_t{i} - 20) << 24;
    const int n_doubled = i / 10;
    EXPECT_NEAR(scale.normalized(error, 3),
                coarser_scale.normalized(error >> n_doubled, 3 + n_doubled), rounding);
  }
}

// The outlier determines the mean square of 101 errors: it would be sqrt(101) = 10 without a limit.
TEST(ErrorScale, ClipsAnOutlierToThreeAndKeepsZero) {
  ErrorScale scale;
  for (int i = 0; i < 100; ++i) scale.normalized(1 << 20, 0);
  EXPECT_EQ(scale.normalized(std::int64_t{1} << 33, 0) / kOne, 3.0);
  EXPECT_EQ(ErrorScale().normalized(0, 0), 0);
}

}  // namespace
}  // namespace sdnn::agents::detail
