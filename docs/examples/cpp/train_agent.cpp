// Makes an agent, trains it on a cart that is pushed to the middle of a rail, and saves it.
//
// Usage: train_agent FILE [seed]. Prints the mean distance to the middle in m, of each 50 episodes
// of 50 steps. `sdnn.agents.load_agent` and run_agent.cpp read the file.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <sdnn/agents/compiled_controller.hpp>
#include <string>
#include <utility>

int main(int argc, char** argv) try {
  if (argc < 2) return std::puts("usage: train_agent FILE [seed]"), 2;
  using namespace sdnn::agents;
  CompiledController agent({.observation = {.low = {-1.0, -2.0}, .high = {1.0, 2.0}},  // m, m/s
                            .action = Box{.low = {-1.0}, .high = {1.0}},               // m/s^2
                            .seed = argc > 2 ? std::stoull(argv[2]) : 1,
                            .settings = {{"learning.discount", 0.9}, {"warm_up_steps", 500}}});
  double distance = 0.0;
  for (int episode = 0; episode < 200; ++episode) {
    std::array<double, 2> cart = {0.01 * (episode * 37 % 199 - 99), 0.0};  // position, speed
    agent.begin_episode();
    for (int t = 0; t < 50; ++t) {
      const std::array<double, 1> push = {agent.act(cart)[0]};
      const double speed = std::clamp(cart[1] + 0.1 * push[0], -2.0, 2.0);
      const std::array<double, 2> next = {std::clamp(cart[0] + 0.1 * speed, -1.0, 1.0), speed};
      agent.learn(cart, push, -std::abs(next[0]), next, false);
      cart = next;
      distance += std::abs(next[0]) / 2500.0;
    }
    if (episode % 50 != 49) continue;
    std::printf("%3d %.3f\n", episode + 1, std::exchange(distance, 0.0));
  }
  agent.write(argv[1]);
} catch (const std::exception& error) {
  std::fprintf(stderr, "train_agent: %s\n", error.what());
  return 1;
}
