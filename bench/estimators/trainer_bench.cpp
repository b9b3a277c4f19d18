// Training and prediction at the demonstration problem's sizes: two inputs of 1001 bins, 280 units.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "sdnn/coding/random_inverse.hpp"
#include "sdnn/estimators/trainer.hpp"

namespace {

using namespace sdnn;

constexpr std::size_t kUnits = 280;
constexpr std::int32_t kBins = 1001;

std::shared_ptr<const coding::SelectiveDesensitization> code_of(int n_units) {
  core::Random random(1, core::Stream::code_books);
  std::vector<coding::PatternTable> modified;
  std::vector<coding::PatternTable> modifiers;
  for (int pair = 0; pair < 2; ++pair) {
    modified.push_back(coding::random_inverse_patterns({n_units, kBins, n_units / 400}, random));
    modifiers.push_back(coding::random_inverse_patterns({n_units, kBins, n_units / 400}, random));
  }
  return std::make_shared<coding::SelectiveDesensitization>(
      modified, modifiers, std::vector<coding::InputPair>{{0, 1}, {1, 0}});
}

/// Arguments: form, samples, units of a pattern. One iteration is one epoch, the tenth and later.
void epoch(benchmark::State& state) {
  const auto n_samples = static_cast<std::size_t>(state.range(1));
  core::Random random(1, core::Stream::exploration);
  std::vector<std::int32_t> bins;
  std::vector<double> counts;
  for (std::size_t t = 0; t < n_samples; ++t) {
    const auto i = static_cast<std::int32_t>(random.below(kBins));
    const auto j = static_cast<std::int32_t>(random.below(kBins));
    bins.insert(bins.end(), {i, j});
    counts.push_back(40.0 + 200.0 * std::pow(std::sin(i * 0.01) * std::cos(j * 0.01), 2));
  }
  const auto layer = std::make_shared<estimators::ParallelPerceptron>(
      code_of(static_cast<int>(state.range(2))), kUnits, 1);
  const auto form = static_cast<estimators::TrainingForm>(state.range(0));
  estimators::PDeltaTrainer trainer(layer, bins, estimators::PDeltaRule(kUnits, counts, 1), form,
                                    std::size_t{1} << 34, 1);
  std::vector<std::int32_t> order(n_samples);
  std::iota(order.begin(), order.end(), 0);
  for (int warm_up = 0; warm_up < 9; ++warm_up) trainer.present(order);
  for (auto _ : state) benchmark::DoNotOptimize(trainer.present(order));
  state.SetItemsProcessed(state.iterations() * state.range(1));
  state.SetLabel(std::string(estimators::name_of(trainer.form())));
}

/// Argument: units of a pattern. One iteration answers 101 x 1001 lattice points.
void lattice(benchmark::State& state) {
  const estimators::ParallelPerceptron layer(code_of(static_cast<int>(state.range(0))), kUnits, 1);
  std::vector<std::int32_t> bins;
  for (std::int32_t i = 0; i < kBins; i += 10) {
    for (std::int32_t j = 0; j < kBins; ++j) bins.insert(bins.end(), {i, j});
  }
  std::vector<std::int32_t> counts(bins.size() / 2);
  for (auto _ : state) layer.counts(bins, 1, 1, counts);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(counts.size()));
}

constexpr auto kDual = static_cast<std::int64_t>(estimators::TrainingForm::dual);
constexpr auto kBlock = static_cast<std::int64_t>(estimators::TrainingForm::block);
constexpr auto kPlain = static_cast<std::int64_t>(estimators::TrainingForm::plain);

BENCHMARK(epoch)
    ->Args({kDual, 2000, 2000})
    ->Args({kBlock, 2000, 2000})
    ->Args({kPlain, 2000, 2000})
    ->Args({kDual, 2000, 8000})
    ->Args({kBlock, 50000, 2000})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(lattice)->Arg(2000)->Arg(8000)->Unit(benchmark::kMillisecond);

}  // namespace
