// The calls that an agent makes: values of new and remembered states, learning steps.
#include <benchmark/benchmark.h>

#include <cstddef>
#include <vector>

#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/random.hpp"

namespace {

using namespace sdnn;
using Network = approximators::SDNNC;

constexpr int kLearningSteps = 500;

/// A network that has learned something, and states for it.
class Setting {
 public:
  explicit Setting(benchmark::State& state)
      : network({.n_inputs = static_cast<int>(state.range(0))}, 1),
        workspace(network.workspace()),
        at(network.n_inputs()),
        values(network.n_actions()) {
    for (int i = 0; i < kLearningSteps; ++i) {
      move();
      network.update(at, workspace, random.below(values.size()), 40.0 * random.uniform() - 20.0);
    }
  }

  /// On to a state that the network has not met.
  void move() {
    for (double& x : at) x = random.uniform();
  }

  Network network;
  Network::Workspace workspace;
  core::Random random{1, core::Stream::exploration};
  std::vector<double> at;
  std::vector<double> values;
};

void values_of_new_state(benchmark::State& state) {
  Setting setting(state);
  for (auto _ : state) {
    setting.move();
    setting.network.values(setting.at, setting.workspace, setting.values);
    benchmark::DoNotOptimize(setting.values.data());
  }
}
BENCHMARK(values_of_new_state)
    ->ArgName("inputs")
    ->Arg(4)
    ->Arg(5)
    ->Arg(6)
    ->Unit(benchmark::kMicrosecond);

void values_of_remembered_state(benchmark::State& state) {
  Setting setting(state);
  for (auto _ : state) {
    setting.network.values(setting.at, setting.workspace, setting.values);
    benchmark::DoNotOptimize(setting.values.data());
  }
}
BENCHMARK(values_of_remembered_state)
    ->ArgName("inputs")
    ->Arg(4)
    ->Arg(5)
    ->Arg(6)
    ->Unit(benchmark::kMicrosecond);

/// Learning steps up and down in turn at one state, five units each where so many can change.
void learning_step(benchmark::State& state) {
  Setting setting(state);
  const double step = 5.0 * 40.0 / 260.0;
  double sign = 1.0;
  for (auto _ : state) {
    const double value = setting.network.value(setting.at, setting.workspace, 300);
    setting.network.update(setting.at, setting.workspace, 300, value + sign * step);
    sign = -sign;
  }
}
BENCHMARK(learning_step)->ArgName("inputs")->Arg(4)->Arg(5)->Arg(6)->Unit(benchmark::kMicrosecond);

}  // namespace
