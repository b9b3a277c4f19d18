#include "sdnn/agents/range_use.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

namespace sdnn::agents {
namespace {

using Numbers = std::vector<double>;

TEST(RangeNotes, StateTheSharesOfRangesThatAreUsedAndOfValuesBeyondThem) {
  const double pi = std::numbers::pi;
  const Observations observations(
      {.low = {0.0, -1.0, -pi, 0.0}, .high = {100.0, 1.0, pi, 1.0}, .angles = {2}}, false, 1);
  RangeNotes notes(4);
  for (int t = 0; t < 4000; ++t) {
    notes.note(Numbers{20.0 + t / 100.0, t % 4 == 0 ? 3.0 : 0.0, 1.0 * t, 0.5});
    if (t == 80) {  // about 10 notes, and 20 are needed
      EXPECT_FALSE(notes.use(observations)[0]);
    }
  }
  const auto use = notes.use(observations);
  // About one step in eight is noted and the last 256 notes are kept: 2048 steps of 1/100. The
  // middle 90 % of the noted values are the used range.
  EXPECT_NEAR(use[0]->share_used, 0.9 * 2048 / 100.0 / 100.0, 0.02);
  EXPECT_EQ(use[1]->share_used, 0.5);  // from 0 to 1; 3 is clipped to 1
  EXPECT_NEAR(use[1]->share_beyond, 0.25, 0.08);
  EXPECT_FALSE(use[2]);  // an angle
  EXPECT_EQ(use[3]->share_used, 0.0);
  EXPECT_EQ(use[0]->share_beyond, 0.0);
}

// The gaps between notes are random. Each eighth observation would be in the same one, two or three
// phases of the periods 8, 16 and 24, whose values use at most 0.7 of the range.
TEST(RangeNotes, SampleAllPhasesOfRegularEpisodes) {
  const Observations observations({.low = {0.0}, .high = {1.0}}, false, 1);
  for (const int period : {3, 4, 5, 8, 16, 24}) {
    RangeNotes notes(1);
    for (int t = 0; t < 4000; ++t) notes.note(Numbers{(t % period) / (period - 1.0)});
    EXPECT_GT(notes.use(observations)[0]->share_used, 0.8) << period;
  }
}

}  // namespace
}  // namespace sdnn::agents
