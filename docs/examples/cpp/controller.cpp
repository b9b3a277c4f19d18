// A controller without Python: an agent learns to swing up an acrobot at a fixed rate, is saved,
// and taken up again from its file, by this program or by Python.
//
// Usage: controller FILE [n_episodes] [seed] [rate]. Learns, saves, loads, and runs one greedy
// episode with `rate` decisions a second (0: as fast as it goes). Prints the decisions that the
// loaded agent used, whether it reached the goal, and how many came too late.
#include <array>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>

#include "sdnn/agents/compiled_controller.hpp"
#include "sdnn/agents/fixed_rate.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/goal_schedule.hpp"

namespace {

using namespace sdnn;
constexpr double kSpeed = 9.0;  // rad/s that the controller tells apart

// Returns the readings of the robot's sensors: two angles and two speeds.
std::array<double, 4> observe(const environments::Acrobot& acrobot) {
  const auto& state = acrobot.state();
  return {state[0], state[1], state[2], state[3]};
}

agents::CompiledController new_controller(double max_torque, std::uint64_t seed) {
  constexpr double kPi = std::numbers::pi;
  return agents::CompiledController(
      {.agent = "sdnn-c",
       .preset = "robust",
       .observation = {.low = {-kPi, -kPi, -kSpeed, -kSpeed}, .high = {kPi, kPi, kSpeed, kSpeed}},
       .action = agents::Box{{-max_torque}, {max_torque}},
       .seed = seed,
       .settings = {{"observation.angles", "[0, 1]"}}});
}

struct Outcome {
  int n_decisions = 0;
  std::int64_t n_late = 0;
  bool solved = false;
};

Outcome run_episode(agents::CompiledController& controller, environments::Acrobot& acrobot,
                    double lambda, bool learning, double rate) {
  Outcome outcome;
  acrobot.reset();
  controller.begin_episode();
  auto observed = observe(acrobot);
  std::optional<agents::FixedRate> ticks;
  if (rate > 0.0) ticks.emplace(rate);
  for (bool over = false; !over;) {
    if (ticks) ticks->wait();
    const std::array<double, 1> torque = {controller.act(observed, learning)[0]};
    const auto result = acrobot.step(torque[0], lambda);
    const auto next = observe(acrobot);
    if (learning) controller.learn(observed, torque, result.reward, next, result.terminated);
    observed = next;
    ++outcome.n_decisions;
    outcome.solved = result.terminated;
    over = result.terminated || result.truncated;
  }
  if (ticks) outcome.n_late = ticks->n_misses();
  return outcome;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2) {
    std::fprintf(stderr, "usage: controller FILE [n_episodes] [seed] [rate]\n");
    return 2;
  }
  const std::filesystem::path path = argv[1];
  const int n_episodes = argc > 2 ? std::stoi(argv[2]) : 100;
  const std::uint64_t seed = argc > 3 ? std::stoull(argv[3]) : 1;
  const double rate = argc > 4 ? std::stod(argv[4]) : 0.0;

  environments::Acrobot acrobot;
  auto controller = new_controller(acrobot.config().max_torque, seed);
  const environments::GoalSchedule lambda;
  for (int episode = 1; episode <= n_episodes; ++episode) {
    run_episode(controller, acrobot, lambda(episode), true, 0.0);
  }
  controller.write(path);

  agents::CompiledController loaded(path);
  const Outcome test = run_episode(loaded, acrobot, lambda(n_episodes), false, rate);
  std::printf("%d %s %lld\n", test.n_decisions, test.solved ? "solved" : "-",
              static_cast<long long>(test.n_late));
} catch (const std::exception& error) {
  std::fprintf(stderr, "controller: %s\n", error.what());
  return 1;
}
