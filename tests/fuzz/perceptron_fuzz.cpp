// Any tables, weights, samples, targets and orders: the three forms of training leave the same
// bits, or refuse for the same reason.
#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>

#include "input.hpp"
#include "sdnn/estimators/trainer.hpp"

namespace {

using namespace sdnn;
using estimators::TrainingForm;

/// Returns n integers: in an eighth of the calls any, else all in [low, high].
std::vector<std::int32_t> any_integers(FuzzedDataProvider& input, std::size_t n, int low,
                                       int high) {
  std::vector<std::int32_t> values(n);
  const bool wild = input.ConsumeIntegralInRange(0, 7) == 0;
  for (auto& value : values) {
    value = wild ? input.ConsumeIntegral<std::int32_t>()
                 : input.ConsumeIntegralInRange(low, std::max(low, high));
  }
  return values;
}

void train(FuzzedDataProvider& input) {
  const auto n_inputs = input.ConsumeIntegralInRange<std::size_t>(1, 3);
  const auto n_bins = input.ConsumeIntegralInRange<std::size_t>(1, 5);
  const auto n_pattern_units = input.ConsumeIntegralInRange<std::size_t>(1, 70);
  std::vector<coding::InputPair> pairs;
  std::vector<coding::PatternTable> modified, modifiers;
  const auto any_table = [&] {
    coding::PatternTable table(n_bins, n_pattern_units);
    const auto bytes = input.ConsumeBytes<std::uint8_t>(8);
    for (std::size_t bin = 0; bin < n_bins; ++bin) {
      for (std::size_t k = 0; k < n_pattern_units; ++k) {
        if (!bytes.empty() && bytes[(bin * 7 + k) % bytes.size()] >> k % 8 & 1) table.flip(bin, k);
      }
    }
    return table;
  };
  for (int p = input.ConsumeIntegralInRange(1, 4); p > 0; --p) {
    pairs.push_back({input.ConsumeIntegralInRange<std::size_t>(0, n_inputs),
                     input.ConsumeIntegralInRange<std::size_t>(0, n_inputs)});
    modified.push_back(any_table());
    modifiers.push_back(any_table());
  }
  const auto code = std::make_shared<coding::SelectiveDesensitization>(
      std::move(modified), std::move(modifiers), std::move(pairs));
  const auto n_groups = input.ConsumeIntegralInRange<std::size_t>(0, 3);
  const auto n_units = input.ConsumeIntegralInRange<std::size_t>(0, 12);
  const auto n_samples = input.ConsumeIntegralInRange<std::size_t>(0, 9);
  const auto weights = any_integers(input, n_units * code->n_columns(), -3, 3);
  const auto thresholds = any_integers(input, n_units, -3, 3);
  const auto bins =
      any_integers(input, n_samples * code->n_inputs(), 0, static_cast<int>(n_bins) - 1);
  const auto targets =
      fuzz::any_doubles(input, n_samples * n_groups, -1.0, static_cast<double>(n_units) + 1.0);
  std::vector<std::vector<std::int32_t>> orders(2);
  for (auto& order : orders) {
    order = any_integers(input, input.ConsumeIntegralInRange<std::size_t>(0, 20), 0,
                         static_cast<int>(n_samples) - 1);
  }

  std::optional<std::vector<std::int32_t>> first;
  for (const auto form : {TrainingForm::plain, TrainingForm::dual, TrainingForm::block}) {
    std::vector<std::int32_t> bits;
    std::shared_ptr<estimators::ParallelPerceptron> layer;
    bool done = fuzz::accepted([&] {
      layer = std::make_shared<estimators::ParallelPerceptron>(code, n_units, weights, thresholds);
    });
    if (done) {
      done = fuzz::accepted([&] {
        estimators::PDeltaTrainer trainer(layer, bins,
                                          estimators::PDeltaRule(n_units, targets, n_groups), form,
                                          std::size_t{1} << 24, 1);
        for (const auto& order : orders) fuzz::accepted([&] { trainer.present(order); });
        trainer.synchronize();
      });
      bits.resize(n_units * code->n_columns());
      layer->copy_weights(bits);
      bits.insert(bits.end(), layer->thresholds().begin(), layer->thresholds().end());
      bits.push_back(done ? 1 : 0);
    }
    if (!first) first = bits;
    fuzz::expect(*first == bits, "two forms of training differ");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  sdnn::fuzz::accepted([&] { train(input); });
  return 0;
}
