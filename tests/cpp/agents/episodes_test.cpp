#include "sdnn/agents/episodes.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <stdexcept>

#include "errors.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

struct Episode {
  int steps = 0;
};

/// An object with episodes, whose numbers of steps start at `first`.
struct ObjectWithEpisodes {
  int first = 5;
  Episodes<Episode> episodes{Episode{first}};

  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    Episodes<Episode>::serialize(
        self.episodes, archive, [&self] { return Episode{self.first}; },
        [&archive](auto& episode) { archive.number("steps", episode.steps); });
  }
};

// An environment has an episode. resize(n, make) adds episodes of make(), or removes the last.
TEST(Episodes, AreAddedAndRemovedAtTheEnd) {
  Episodes<Episode> episodes(Episode{1});
  EXPECT_EQ(episodes.size(), 1U);
  episodes.resize(3, [] { return Episode{7}; });
  episodes.of(2).steps = 9;
  EXPECT_EQ(episodes.of(0).steps, 1);
  EXPECT_EQ(episodes.of(1).steps, 7);
  episodes.resize(2, [] { return Episode{8}; });
  EXPECT_EQ(episodes.of(1).steps, 7);
  episodes.resize(3, [] { return Episode{8}; });
  EXPECT_EQ(episodes.of(2).steps, 8);
}

TEST(Episodes, AreSavedWithTheNumberOfTheirEnvironmentRestoredAndRefusedIfDamaged) {
  ObjectWithEpisodes object;
  EXPECT_EQ(core::state_of(object).size(), 1U);
  EXPECT_EQ(testing::number_of<int>(core::state_of(object), "steps"), object.first);
  object.episodes.resize(3, [] { return Episode{6}; });
  const core::State state = core::state_of(object);
  EXPECT_EQ(state.size(), 3U);
  EXPECT_EQ(testing::number_of<int>(state, "environment.2.steps"), 6);
  ObjectWithEpisodes restored;
  core::restore(restored, state);
  EXPECT_EQ(core::state_of(restored), state);
  core::restore(restored, core::state_of(ObjectWithEpisodes{}));
  EXPECT_EQ(restored.episodes.size(), 1U);
  testing::expect_damaged_states_refused(restored);
}

TEST(Episodes, RefuseBadNumbersOfEnvironments) {
  Episodes<Episode> episodes(Episode{1});
  const auto make = [] { return Episode{}; };
  EXPECT_EQ(testing::message_of([&] { (void)episodes.of(1); }),
            "environment must be less than 1, got 1");
  for (const std::size_t bad : {std::size_t{0}, kMostEnvironments + 1}) {
    EXPECT_THROW(episodes.resize(bad, make), std::invalid_argument);
  }
  EXPECT_EQ(episodes.size(), 1U);
}

}  // namespace
}  // namespace sdnn::agents
