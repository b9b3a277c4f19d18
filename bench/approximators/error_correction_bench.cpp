// Selecting the units that a learning step corrects.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

#include "sdnn/approximators/error_correction.hpp"
#include "sdnn/core/random.hpp"

namespace {

/// Argument: the deficit.
void selection(benchmark::State& state) {
  sdnn::core::Random random(1, sdnn::core::Stream::weights);
  std::vector<std::int32_t> potentials(300);
  for (std::int32_t& h : potentials) {
    h = static_cast<std::int32_t>(random.below(2001)) - 1000;
  }
  std::vector<std::uint32_t> selected;
  selected.reserve(potentials.size());
  const auto deficit = static_cast<int>(state.range(0));
  for (auto _ : state) {
    sdnn::approximators::select_units(potentials, deficit, selected);
    benchmark::DoNotOptimize(selected.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(selection)->ArgName("deficit")->Arg(1)->Arg(-1)->Arg(5)->Arg(-5)->Arg(30)->Arg(150);

}  // namespace
