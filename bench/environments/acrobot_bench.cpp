// A decision of the acrobot: 50 Runge-Kutta steps.
#include <benchmark/benchmark.h>

#include "sdnn/core/random.hpp"
#include "sdnn/environments/acrobot.hpp"

namespace {

void acrobot_decision(benchmark::State& state) {
  sdnn::environments::Acrobot acrobot({.max_decisions = 51, .goal_height = 10.0});
  sdnn::core::Random random(1, sdnn::core::Stream::exploration);
  for (auto _ : state) {
    if (acrobot.decisions() == 50) acrobot.reset();
    benchmark::DoNotOptimize(acrobot.step(20.0 * random.uniform() - 10.0, 1.0));
  }
  state.SetItemsProcessed(50 * state.iterations());
}
BENCHMARK(acrobot_decision)->Unit(benchmark::kMicrosecond);

}  // namespace
