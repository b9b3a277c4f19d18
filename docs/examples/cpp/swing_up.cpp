// A small controller: SDNN-C learns online to swing up an acrobot.
//
// Usage: swing_up [n_episodes] [seed]. Prints one line per test episode, that is after every ten
// learning episodes: learning episodes so far, decisions used, and whether the goal was reached.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/sdnn.hpp"

namespace {

using Network = sdnn::approximators::SDNNC;

struct Outcome {
  int n_decisions = 0;
  bool solved = false;
};

Outcome run_episode(sdnn::agents::QLearning<Network>& agent, sdnn::environments::Acrobot& acrobot,
                    sdnn::environments::AcrobotSensors& sensors, double lambda, bool learning) {
  const double max_torque = acrobot.config().max_torque;
  std::vector<double> observed(sensors.n_inputs());
  std::vector<double> next_observed(observed.size());
  Outcome outcome;
  acrobot.reset();
  agent.begin_episode();
  sensors.observe(acrobot.state(), observed);
  for (bool over = false; !over;) {
    const auto action = agent.act(observed, learning);
    const auto result = acrobot.step(max_torque * agent.normalized_action(action), lambda);
    sensors.observe(acrobot.state(), next_observed);
    if (learning) agent.learn(observed, action, result.reward, next_observed, result.terminated);
    std::swap(observed, next_observed);
    ++outcome.n_decisions;
    outcome.solved = result.terminated;
    over = result.terminated || result.truncated;
  }
  return outcome;
}

}  // namespace

int main(int argc, char** argv) try {
  const int n_episodes = argc > 1 ? std::stoi(argv[1]) : 300;
  const std::uint64_t seed = argc > 2 ? std::stoull(argv[2]) : 1;

  const sdnn::environments::SensorConfig sensor_config{.n_sensors = 4, .noise = 0.0};
  const auto preset = sdnn::agents::robust_preset(sensor_config.n_sensors);
  sdnn::agents::QLearning agent(Network(preset.approximator, seed), preset.learning, seed);
  sdnn::environments::Acrobot acrobot;
  sdnn::environments::AcrobotSensors sensors(sensor_config, seed, sdnn::core::Stream::sensor_noise);
  sdnn::environments::AcrobotSensors test_sensors(sensor_config, seed,
                                                  sdnn::core::Stream::evaluation_sensor_noise);
  const sdnn::environments::GoalSchedule lambda;

  for (int episode = 1; episode <= n_episodes; ++episode) {
    run_episode(agent, acrobot, sensors, lambda(episode), true);
    if (episode % 10 != 0) continue;
    const Outcome test = run_episode(agent, acrobot, test_sensors, lambda(episode), false);
    std::printf("%5d %3d %s\n", episode, test.n_decisions, test.solved ? "solved" : "-");
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "swing_up: %s\n", error.what());
  return 1;
}
