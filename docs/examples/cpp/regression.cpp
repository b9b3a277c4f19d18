// The network as a regressor, in C++ alone: learns a function of two inputs and prints its error.
//
// Usage: regression [n_epochs] [seed]. Prints the root mean square error over a lattice of points
// after each tenth of the epochs.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "sdnn/sdnn.hpp"

namespace {

constexpr int kBins = 101;           // a lattice of 101 x 101 points
constexpr std::size_t kUnits = 120;  // outputs from -0.1 to 1.1 in steps of 0.01
constexpr double kLow = -0.1;
constexpr double kStep = 0.01;

double target(std::int32_t i, std::int32_t j) {
  const double x = (i - 50) / 50.0;
  const double y = (j - 50) / 50.0;
  return std::exp(-4.0 * (x * x + y * y));
}

void run(int n_epochs, std::uint64_t seed) {
  using namespace sdnn;
  // Each ordered pair of inputs has two tables: patterns of the first input, and those of the
  // second that desensitize them.
  core::Random random(seed, core::Stream::code_books);
  const coding::RandomInverseConfig config{.n_units = 1000, .n_bins = kBins, .n_flipped = 10};
  std::vector<coding::PatternTable> modified;
  std::vector<coding::PatternTable> modifiers;
  for (int pair = 0; pair < 2; ++pair) {
    modified.push_back(coding::random_inverse_patterns(config, random));
    modifiers.push_back(coding::random_inverse_patterns(config, random));
  }
  const auto code = std::make_shared<const coding::SelectiveDesensitization>(
      modified, modifiers, std::vector<coding::InputPair>{{0, 1}, {1, 0}});
  const auto layer = std::make_shared<estimators::ParallelPerceptron>(code, kUnits, seed);

  std::vector<std::int32_t> bins;
  std::vector<double> counts;  // the numbers of units that should fire
  core::Random points(seed, core::Stream::exploration);
  for (int t = 0; t < 500; ++t) {
    const auto i = static_cast<std::int32_t>(points.below(kBins));
    const auto j = static_cast<std::int32_t>(points.below(kBins));
    bins.insert(bins.end(), {i, j});
    counts.push_back((target(i, j) - kLow) / kStep);
  }
  estimators::PDeltaTrainer trainer(layer, bins, estimators::PDeltaRule(kUnits, counts, 1),
                                    estimators::TrainingForm::automatic, std::size_t{1} << 28, 1);
  std::vector<std::int32_t> lattice;
  for (std::int32_t i = 0; i < kBins; ++i) {
    for (std::int32_t j = 0; j < kBins; ++j) lattice.insert(lattice.end(), {i, j});
  }
  std::vector<std::int32_t> order(counts.size());
  std::iota(order.begin(), order.end(), 0);
  std::vector<std::int32_t> firing(lattice.size() / 2);
  for (int epoch = 1; epoch <= n_epochs; ++epoch) {
    trainer.present(order);
    if (epoch % ((n_epochs + 9) / 10) != 0) continue;
    trainer.synchronize();
    layer->counts(lattice, 1, 1, firing);
    double sum = 0.0;
    for (std::size_t p = 0; p < firing.size(); ++p) {
      const double error = kStep * firing[p] + kLow - target(lattice[2 * p], lattice[2 * p + 1]);
      sum += error * error;
    }
    std::printf("%d %.4f\n", epoch, std::sqrt(sum / static_cast<double>(firing.size())));
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc > 1 ? std::stoi(argv[1]) : 100, argc > 2 ? std::stoull(argv[2]) : 1);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "regression: %s\n", error.what());
    return 1;
  }
  return 0;
}
