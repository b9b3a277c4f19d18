// Trials from the first episode on; items are decisions.
#include <benchmark/benchmark.h>

#include <cstdint>

#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "tools/trial.hpp"

namespace {

using namespace sdnn;
using Trial = tools::AcrobotTrial<agents::QLearning<approximators::SDNNC>>;

/// Arguments: inputs, noise in per cent, learning episodes.
void trial(benchmark::State& state) {
  const auto n_inputs = static_cast<int>(state.range(0));
  const double noise = static_cast<double>(state.range(1)) / 100.0;
  std::int64_t n_decisions = 0;
  for (auto _ : state) {
    state.PauseTiming();
    Trial run(agents::QLearning(approximators::SDNNC({.n_inputs = n_inputs}, 1), {}, 1), {}, {},
              {.n_sensors = n_inputs, .noise = noise}, {}, 1);
    state.ResumeTiming();
    run.advance(static_cast<int>(state.range(2)));
    n_decisions += run.n_decisions();
  }
  state.SetItemsProcessed(n_decisions);
}
BENCHMARK(trial)
    ->ArgNames({"inputs", "noise", "episodes"})
    ->ArgsProduct({{4, 6}, {0, 2}, {200, 2000}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
