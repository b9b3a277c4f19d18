#include "sdnn/core/detail/interruption.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <span>
#include <stdexcept>
#include <vector>

#include "interruptions.hpp"
#include "sdnn/coding/anchor_patterns.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/environments/acrobot_batch.hpp"

namespace sdnn::core {
namespace {

using testing::n_points_left;
using testing::StopAt;
using testing::StopError;

TEST(Interruption, DoesNothingUntilItIsRequested) {
  EXPECT_NO_THROW(interruption_point());
  const StopAt stop(1);  // throws at the second point from here on
  EXPECT_NO_THROW(interruption_point());
  EXPECT_THROW(interruption_point(), StopError);
}

// A slow check, such as Python's for signals, may skip points unless it should run at once.
TEST(Interruption, PassesOnWhetherToCheckImmediately) {
  static int n_at_once;
  n_at_once = 0;
  interruption_check() = [](bool at_once) { n_at_once += at_once ? 1 : 0; };
  interruption_point();
  EXPECT_EQ(n_at_once, 0);
  interruption_point(true);
  EXPECT_EQ(n_at_once, 1);
  interruption_check() = nullptr;
}

// An interruption point is where long work may be stopped; StopAt stops at the fifth one.
TEST(Interruption, EndsTheGenerationOfPatterns) {
  Random random(1, Stream::code_books);
  const coding::AnchorConfig config{.n_units = 20, .n_anchor_patterns = 3, .n_interpolated = 4};
  const StopAt stop(4);  // counted from 0
  EXPECT_THROW(coding::anchor_patterns(config, random), StopError);
}

TEST(Interruption, DoesNotChangeTheOrderOfAShuffleThatContinues) {
  std::vector<std::uint32_t> expected(200'000), shuffled(200'000);
  std::iota(expected.begin(), expected.end(), 0U);
  std::iota(shuffled.begin(), shuffled.end(), 0U);
  Random(1, Stream::weights).shuffle(std::span(expected));
  const StopAt stop(1000);  // far more points than the shuffle has
  Random(1, Stream::weights).shuffle(std::span(shuffled));
  EXPECT_LT(n_points_left, 1000);
  EXPECT_EQ(expected, shuffled);
}

// A stopped step leaves acrobots between two decisions, so their episodes cannot continue.
TEST(Interruption, AStoppedStepEndsTheMovingEpisodesOfABatch) {
  environments::AcrobotBatch batch({}, 3);
  const std::vector<double> torques(3, 1.0), tolerances(3, 1.0);
  std::vector<std::uint8_t> moving{1, 0, 1}, terminated(3), truncated(3);
  std::vector<double> rewards(3);
  const environments::AcrobotBatchResults results{rewards, terminated, truncated};
  {
    const StopAt stop(0);  // at the first interruption point of the step
    EXPECT_THROW(batch.step(torques, tolerances, moving, results), StopError);
  }
  EXPECT_THROW(batch.step(torques, tolerances, moving, results), std::logic_error);
  moving = {0, 1, 0};  // the acrobot that the stopped step did not move
  EXPECT_NO_THROW(batch.step(torques, tolerances, moving, results));
  batch.reset();
  moving = {1, 1, 1};
  EXPECT_NO_THROW(batch.step(torques, tolerances, moving, results));
  EXPECT_EQ(batch.state(0), batch.state(2));
}

}  // namespace
}  // namespace sdnn::core
