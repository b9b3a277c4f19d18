// A pass over the hidden layer at the paper's sizes, on every instruction set.
#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/core/instruction_set.hpp"
#include "sdnn/core/random.hpp"

namespace {

using namespace sdnn;

constexpr std::size_t kUnits = 900;

/// Half of the columns, in equal parts positive and negative.
struct HalfOf {
  std::vector<std::uint32_t> plus;
  std::vector<std::uint32_t> minus;

  explicit HalfOf(std::size_t n_columns) {
    core::Random random(1, core::Stream::exploration);
    for (std::uint32_t j = 0; j < n_columns; ++j) {
      if (random.below(2) == 0) (random.below(2) == 0 ? plus : minus).push_back(j);
    }
  }
};

/// Arguments: level of the instruction set, columns, largest |weight|.
void hidden_pass(benchmark::State& state) {
  const auto level = static_cast<core::InstructionSet>(state.range(0));
  if (!core::offers(level)) {
    state.SkipWithError("this processor does not offer the instruction set");
    return;
  }
  const std::string before(core::name_of(core::instruction_set()));
  core::set_instruction_set(core::name_of(level));
  const auto n_columns = static_cast<std::size_t>(state.range(1));
  const auto largest = static_cast<std::int32_t>(state.range(2));
  approximators::HiddenLayer hidden_layer(kUnits, n_columns);
  core::Random random(2, core::Stream::weights);
  for (std::size_t i = 0; i < kUnits; ++i) {
    for (std::size_t j = 0; j < n_columns; ++j) {
      const auto drawn = random.below(2 * static_cast<std::uint64_t>(largest) + 1);
      hidden_layer.set_weight(i, j, static_cast<std::int32_t>(drawn) - largest);
    }
  }
  const HalfOf columns(n_columns);
  std::vector<std::int32_t> out(kUnits);
  for (auto _ : state) {
    hidden_layer.potentials({columns.plus, columns.minus}, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  const auto n_read = static_cast<std::int64_t>(columns.plus.size() + columns.minus.size());
  state.SetBytesProcessed(state.iterations() * n_read * 960);
  state.SetLabel(std::string(core::name_of(level)));
  core::set_instruction_set(before);
}
BENCHMARK(hidden_pass)
    ->ArgNames({"level", "columns", "largest"})
    ->ArgsProduct({{0, 1, 2, 3}, {2400, 6000}, {1, 50, 100}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
