/// The paper's experiment B in a browser: a trial of SDNN-C and one of fuzzy Q-learning, with the
/// same sensor noise. The page's worker calls the exported functions; a parameter `side` selects
/// the trial, 0 for SDNN-C and 1 for fuzzy Q-learning.
#include "sdnn/environments/acrobot.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/fuzzy_q_learning_config.hpp"
#include "sdnn/agents/presets.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/detail/crc32.hpp"
#include "sdnn/core/pcg64.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "sdnn/environments/acrobot_sensors.hpp"
#include "sdnn/environments/acrobot_state.hpp"
#include "tools/trial.hpp"
#include "wasm/sha256.hpp"

namespace {

using namespace sdnn;
using environments::AcrobotState;

/// Derives the seed of a case's first trial, as `sdnn.runs.engine.trial_seed` does.
std::uint64_t trial_seed(std::uint32_t root_seed, std::string_view case_id) {
  const std::uint32_t case_word = core::detail::crc32(std::as_bytes(std::span(case_id)));
  const std::array<std::uint32_t, 6> entropy{root_seed, 0, 0, 0, case_word, 0};
  return core::Pcg64::generated_state(entropy)[0] >> 1U;
}

/// A trial that records the decisions of the present episode, so that the page can show the motion.
template <class Agent>
class WatchedTrial {
 public:
  WatchedTrial(Agent agent, const environments::SensorConfig& sensors,
               const tools::ProtocolConfig& protocol, std::uint64_t seed)
      : trial_(std::move(agent), {}, {}, sensors, protocol, seed), motion_(single_steps()) {}

  const tools::AcrobotTrial<Agent>& trial() const noexcept { return trial_; }

  /// Makes one decision.
  void decide() {
    const AcrobotState before = trial_.acrobot().state();
    std::array<tools::AcrobotTrial<Agent>*, 1> trials{&trial_};
    tools::AcrobotTrial<Agent>::advance_together(trials, 1);
    remember(before);
  }

  /// Finishes the present episode or else the next learning episode, with the test episode that is
  /// due after it.
  void finish_episode() {
    AcrobotState before = trial_.acrobot().state();
    trial_.advance(1, [&] {
      remember(before);
      before = trial_.acrobot().state();
    });
  }

  /// The number of decisions in the present or last episode.
  int n_decisions() const noexcept { return static_cast<int>(episode_.size()); }

  /// The state `n_steps` integration steps after a decision of this episode, or at the goal.
  AcrobotState state_after(int decision, int n_steps) {
    const Decision& made = episode_.at(static_cast<std::size_t>(decision));
    motion_.set_state(made.state);
    for (int i = 0; i < n_steps; ++i) {
      if (motion_.step(made.torque, trial_.goal_tolerance()).terminated) break;
    }
    return motion_.state();
  }

  /// The torque of a decision of this episode, N m.
  double torque(int decision) const {
    return episode_.at(static_cast<std::size_t>(decision)).torque;
  }

  /// The SHA-256 of the rows, as `sdnn.runs.trial.TrialRows.digest` computes it.
  std::string digest() const {
    std::vector<std::uint8_t> bytes;
    const auto append = [&](std::uint64_t value, int n_bytes) {
      for (int i = 0; i < n_bytes; ++i) {
        bytes.push_back(static_cast<std::uint8_t>(value >> static_cast<unsigned>(8 * i)));
      }
    };
    for (const auto& row : trial_.rows()) append(static_cast<std::uint32_t>(row.episode), 4);
    for (const auto& row : trial_.rows()) append(static_cast<std::uint32_t>(row.steps), 4);
    for (const auto& row : trial_.rows()) {
      append(std::bit_cast<std::uint64_t>(row.episode_return), 8);
    }
    for (const auto& row : trial_.rows()) append(row.solved ? 1 : 0, 1);
    return wasm::sha256(std::move(bytes));
  }

 private:
  struct Decision {
    AcrobotState state;
    double torque;
  };

  /// Records a decision that was made in the state `before`. The first decision of an episode is
  /// made at rest, whatever the state before the reset was.
  void remember(const AcrobotState& before) {
    const bool is_first = trial_.acrobot().decisions() == 1;
    if (is_first) episode_.clear();
    episode_.push_back({is_first ? AcrobotState::Zero().eval() : before, trial_.torque()});
  }

  /// Returns the configuration of an acrobot whose decisions last for a single integration step.
  static environments::AcrobotConfig single_steps() {
    environments::AcrobotConfig config;
    config.decision_interval = config.integration_step;
    return config;
  }

  tools::AcrobotTrial<Agent> trial_;
  environments::Acrobot motion_;   // repeats a decision step by step
  std::vector<Decision> episode_;  // the decisions of the present or last episode
};

/// The two trials of a case.
struct Experiment {
  std::string case_id;
  std::uint64_t seed;
  WatchedTrial<agents::QLearning<approximators::SDNNC>> sdnn_c;
  WatchedTrial<agents::FuzzyQLearning> fuzzy;

  Experiment(std::string_view id, const agents::Preset& preset,
             const environments::SensorConfig& sensors, const tools::ProtocolConfig& protocol,
             std::uint32_t root_seed)
      : case_id(id),
        seed(trial_seed(root_seed, id)),
        sdnn_c({approximators::SDNNC(preset.approximator, seed), preset.learning, seed}, sensors,
               protocol, seed),
        fuzzy({approximators::FuzzyRules({.n_inputs = sensors.n_inputs()}),
               agents::FuzzyQLearningConfig{}, seed},
              sensors, protocol, seed) {}

  /// Calls `use(trial)` with the trial of SDNN-C (0) or of fuzzy Q-learning (1).
  template <class Use>
  auto with(int side, const Use& use) {
    return side == 0 ? use(sdnn_c) : use(fuzzy);
  }

  /// The digest of both trials, as `sdnn.runs.trial.records_digest` computes it.
  std::string digest() {
    std::array<std::pair<std::int64_t, std::string>, 2> results;
    for (std::size_t side = 0; side < 2; ++side) {
      results[side] = with(static_cast<int>(side), [](const auto& watched) {
        return std::pair(watched.trial().n_decisions(), watched.digest());
      });
    }
    std::ranges::sort(results);
    std::string text;
    for (const auto& [n_decisions, rows] : results) {
      text += "('" + case_id + "', 0, " + std::to_string(seed) + ", " +
              std::to_string(n_decisions) + ", '" + rows + "')";
    }
    return wasm::sha256({text.begin(), text.end()});
  }
};

std::optional<Experiment> experiment;
std::array<char, 64> text_buffer;
std::array<double, 4> shown_state;

}  // namespace

extern "C" {

/// Returns the buffer of 64 bytes to which the page writes the case's id, and from which it reads
/// the digest.
__attribute__((export_name("text"))) char* text() { return text_buffer.data(); }

/// Begins both trials of the case whose id is the first `id_length` bytes of the buffer `text`.
__attribute__((export_name("begin"))) void begin(int id_length, int n_sensors, double noise,
                                                 std::uint32_t root_seed, int is_robust,
                                                 int n_episodes) {
  const std::string_view id(text_buffer.data(), static_cast<std::size_t>(id_length));
  experiment.reset();
  experiment.emplace(
      id, is_robust != 0 ? agents::robust_preset(n_sensors) : agents::paper_preset(n_sensors),
      environments::SensorConfig{.n_sensors = n_sensors, .noise = noise},
      tools::ProtocolConfig{.episodes = n_episodes}, root_seed);
}

__attribute__((export_name("decide"))) void decide(int side) {
  experiment->with(side, [](auto& watched) { watched.decide(); });
}
__attribute__((export_name("finish_episode"))) void finish_episode(int side) {
  experiment->with(side, [](auto& watched) { watched.finish_episode(); });
}
__attribute__((export_name("is_finished"))) int is_finished(int side) {
  return experiment->with(side, [](auto& watched) { return watched.trial().finished() ? 1 : 0; });
}
/// The number of learning episodes that have begun.
__attribute__((export_name("episode"))) int episode(int side) {
  return experiment->with(side, [](auto& watched) { return watched.trial().episode(); });
}
/// The number of decisions in the present or last episode.
__attribute__((export_name("n_decisions"))) int n_decisions(int side) {
  return experiment->with(side, [](auto& watched) { return watched.n_decisions(); });
}
/// The torque of a decision of this episode, N m.
__attribute__((export_name("torque"))) double torque(int side, int decision) {
  return experiment->with(side, [&](auto& watched) { return watched.torque(decision); });
}
/// The state `n_steps` integration steps after a decision of this episode: 4 doubles, theta1,
/// theta2 (rad), theta1_dot, theta2_dot (rad/s), valid until the next call.
__attribute__((export_name("state"))) const double* state(int side, int decision, int n_steps) {
  const AcrobotState now =
      experiment->with(side, [&](auto& watched) { return watched.state_after(decision, n_steps); });
  std::ranges::copy(now, shown_state.begin());
  return shown_state.data();
}
/// The number of test episodes so far.
__attribute__((export_name("n_tests"))) int n_tests(int side) {
  return experiment->with(
      side, [](auto& watched) { return static_cast<int>(watched.trial().rows().size()); });
}
/// The number of steps of a test episode, negative if it did not reach the goal.
__attribute__((export_name("test_steps"))) int test_steps(int side, int test) {
  return experiment->with(side, [&](auto& watched) {
    const tools::TestRow& row = watched.trial().rows()[static_cast<std::size_t>(test)];
    return row.solved ? row.steps : -row.steps;
  });
}
/// Writes the digest of all rows to `text`: 64 hexadecimal digits.
__attribute__((export_name("digest"))) void digest() {
  std::ranges::copy(experiment->digest(), text_buffer.begin());
}
}
