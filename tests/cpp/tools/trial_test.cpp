#include "tools/trial.hpp"

#include <gtest/gtest.h>

#if defined(__linux__)
#include <sys/resource.h>
#endif

#include <bit>
#include <vector>

#include "allocation_count.hpp"
#include "approximators/lookup_table.hpp"
#include "errors.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::tools {
namespace {

using testing::LookupTable;
using Network = approximators::SDNNC;

/// The settings that a test varies; the others have the paper's values.
struct Setting {
  environments::AcrobotConfig acrobot = {};
  environments::SensorConfig sensors = {};
  ProtocolConfig protocol = {.episodes = 100};
  std::uint64_t seed = 1;
};

template <class Agent>
AcrobotTrial<Agent> agent_trial(Agent agent, const Setting& setting) {
  return {std::move(agent), setting.acrobot, {}, setting.sensors, setting.protocol, setting.seed};
}

template <class Q>
AcrobotTrial<agents::QLearning<Q>> trial(Q q, const Setting& setting) {
  return agent_trial(agents::QLearning<Q>(std::move(q), {}, setting.seed), setting);
}

/// A cheap learner for what does not depend on the approximator.
auto table_trial(const Setting& setting) {
  return trial(LookupTable(static_cast<std::size_t>(setting.sensors.n_sensors), 8, 21), setting);
}

auto network_trial(const Setting& setting) {
  return trial(Network({.n_inputs = setting.sensors.n_sensors}, setting.seed), setting);
}

agents::FuzzyQLearning fuzzy_agent(const Setting& setting) {
  return {approximators::FuzzyRules({.n_inputs = setting.sensors.n_sensors}), {}, setting.seed};
}

auto rbf_trial(const Setting& setting) {
  return trial(approximators::RBFNetwork({.n_inputs = setting.sensors.n_sensors, .width = 1.0}),
               setting);
}

/// A hash of the rows, FNV-1a with its standard offset and prime; returns enter by their bits.
std::uint64_t digest(std::span<const TestRow> rows) {
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&hash](std::uint64_t word) {
    for (int byte = 0; byte < 8; ++byte, word >>= 8) hash = (hash ^ (word & 0xff)) * 0x100000001b3;
  };
  for (const TestRow& row : rows) {
    add(static_cast<std::uint64_t>(row.episode));
    add(static_cast<std::uint64_t>(row.steps));
    add(std::bit_cast<std::uint64_t>(row.episode_return));
    add(row.solved ? 1 : 0);
  }
  return hash;
}

/// Expects a golden trace: a number of decisions and a digest of the rows that were recorded once,
/// and are the same on any machine and compiler.
template <class Trial>
void expect_recorded(Trial trial, int n_episodes, int n_decisions, std::uint64_t rows_digest) {
  trial.advance(n_episodes);
  EXPECT_EQ(trial.rows().size(),
            static_cast<std::size_t>(n_episodes) / 10);  // a row per 10 episodes
  EXPECT_EQ(trial.n_decisions(), n_decisions);
  EXPECT_EQ(digest(trial.rows()), rows_digest);
}

constexpr Setting kPlain{.protocol = {.episodes = 200}};

// Numbers are episodes, decisions and a hash of the rows.
TEST(AcrobotTrial, DecisionsAndRowsOfSDNNCAreThoseRecordedOnce) {
  const Setting noisy{
      .sensors = {.n_sensors = 6, .noise = 0.02}, .protocol = {.episodes = 60}, .seed = 2};
  expect_recorded(network_trial(kPlain), 200, 2541, 15772045298543882794U);
  expect_recorded(network_trial(noisy), 60, 1125, 899986753393664466U);
}

// Numbers are episodes, decisions and a hash of the rows.
TEST(AcrobotTrial, DecisionsAndRowsOfFuzzyQLearningAreThoseRecordedOnce) {
  const Setting noisy{.sensors = {.n_sensors = 6, .noise = 0.02}, .seed = 2};
  expect_recorded(agent_trial(fuzzy_agent(kPlain), kPlain), 200, 973, 16274018572413670715U);
  expect_recorded(agent_trial(fuzzy_agent(noisy), noisy), 100, 2674, 1660777440214468387U);
}

// Numbers are episodes, decisions and a hash of the rows.
TEST(AcrobotTrial, DecisionsAndRowsOfTheRBFNetworkAreThoseRecordedOnce) {
  const Setting noisy{.sensors = {.n_sensors = 5, .noise = 0.02}, .seed = 2};
  expect_recorded(rbf_trial(kPlain), 200, 940, 6814087891175944941U);
  expect_recorded(rbf_trial(noisy), 100, 986, 7920621632295173362U);
}

// Eight trials of different sensors, lengths and seeds advance by the same numbers of decisions.
TEST(AcrobotTrial, TrialsRunTogetherHaveTheRowsOfTrialsRunAlone) {
  const auto make = [](std::size_t i) {
    return table_trial({.sensors = {.n_sensors = 4 + static_cast<int>(i % 3), .noise = 0.01},
                        .protocol = {.episodes = 30 + 10 * static_cast<int>(i)},
                        .seed = i});
  };
  std::vector<decltype(make(0))> alone, together;
  for (std::size_t i = 0; i < 8; ++i) {
    alone.push_back(make(i));
    together.push_back(make(i));
  }
  std::vector<decltype(make(0))*> team;
  for (auto& trial : together) team.push_back(&trial);
  using Trial = decltype(make(0));
  for (const int n : {0, 1, 200, 77}) Trial::advance_together(team, n);
  EXPECT_EQ(together[3].n_decisions(), 0 + 1 + 200 + 77);
  together[3].advance(2);  // it finishes the episode under way first
  for (int i = 0; i < 40; ++i) Trial::advance_together(team, 100);  // until all are finished
  for (std::size_t i = 0; i < 8; ++i) {
    alone[i].advance(1000);
    EXPECT_TRUE(together[i].finished());
    EXPECT_EQ(together[i].n_decisions(), alone[i].n_decisions());
    EXPECT_EQ(digest(together[i].rows()), digest(alone[i].rows()));
    EXPECT_EQ(together[i].agent().networks().front(), alone[i].agent().networks().front());
  }
}

template <class Trial>
void expect_no_allocation(Trial run) {
  const std::size_t before = testing::allocation_count();
  run.advance(10);
  EXPECT_EQ(testing::allocation_count(), before);
}

TEST(AcrobotTrial, ShowsTheAcrobotTheTorqueAndTheGoalToleranceOfTheLastDecision) {
  auto watched = table_trial({});
  const environments::GoalSchedule schedule;
  environments::Acrobot repeated;
  watched.advance(30, [&] {
    if (watched.acrobot().decisions() == 1) repeated.reset();
    repeated.step(watched.torque(), watched.goal_tolerance());
    EXPECT_EQ(repeated.state(), watched.acrobot().state());
    EXPECT_EQ(watched.goal_tolerance(), schedule(watched.episode()));
  });
}

TEST(AcrobotTrial, AnEpisodeAllocatesNothing) {
  const Setting setting{.sensors = {.noise = 0.02}, .protocol = {.episodes = 10}};
  expect_no_allocation(network_trial(setting));
  expect_no_allocation(rbf_trial(setting));
  expect_no_allocation(agent_trial(fuzzy_agent(setting), setting));
}

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)

long n_page_faults() {
  rusage usage;
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

// The constructor of a trial touches all of its memory, so that no decision waits for a page. A
// first trial loads code and libraries; then the operating system may still cause a few faults.
TEST(AcrobotTrial, AnEpisodeCausesNoPageFaults) {
  for (const int n_inputs : {4, 6}) {
    const Setting setting{.sensors = {.n_sensors = n_inputs, .noise = 0.02},
                          .protocol = {.episodes = 60}};
    network_trial(setting).advance(2);
    auto run = network_trial(setting);
    const long before = n_page_faults();
    run.advance(60);
    EXPECT_LE(n_page_faults() - before, 3) << n_inputs << " inputs";
  }
}

#endif

TEST(AcrobotTrial, RefusesBadNumbersAndTrialsThatCannotRunTogether) {
  using testing::message_of;
  EXPECT_EQ(message_of([] { trial(LookupTable(5, 2, 3), {}); }),
            "n_inputs must be the number of inputs of the sensors, 4, got 5");
  EXPECT_EQ(message_of([] { table_trial({}).advance(-1); }),
            "n_episodes must be in [0, 1073741824], got -1");
  auto trial = table_trial({}), on_the_moon = table_trial({.acrobot = {.gravity = 1.6}});
  const auto together = [&](std::vector<decltype(trial)*> trials, int n_decisions) {
    return message_of([&] { decltype(trial)::advance_together(trials, n_decisions); });
  };
  EXPECT_EQ(together({}, 1), "number of trials must be in [1, 8], got 0");
  EXPECT_EQ(together({&trial}, -1), "n_decisions must be in [0, 1073741824], got -1");
  EXPECT_EQ(together({&trial, &trial}, 1), "trials must be different ones, got one twice");
  EXPECT_EQ(together({&trial, &on_the_moon}, 1),
            "trials must be of the same acrobot, got different ones");
}

}  // namespace
}  // namespace sdnn::tools
