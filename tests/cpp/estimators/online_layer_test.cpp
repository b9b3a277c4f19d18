#include "sdnn/estimators/online_layer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "estimators/problems.hpp"
#include "instruction_sets.hpp"
#include "interruptions.hpp"

namespace sdnn {
namespace {

using estimators::OnlineLayer;
using estimators::PDeltaRule;
using estimators::TrainingForm;
using testing::Problem;

/// The samples of an order, one after the other, as a stream has them.
Problem stream_of(const Problem& problem, const std::vector<std::int32_t>& order) {
  Problem stream = problem;
  stream.bins.clear();
  stream.targets.clear();
  const std::size_t n_inputs = problem.code->n_inputs();
  for (const std::int32_t index : order) {
    const auto sample = static_cast<std::size_t>(index);
    for (std::size_t i = 0; i < n_inputs; ++i) {
      stream.bins.push_back(problem.bins[sample * n_inputs + i]);
    }
    for (std::size_t g = 0; g < problem.n_groups; ++g) {
      stream.targets.push_back(problem.targets[sample * problem.n_groups + g]);
    }
  }
  return stream;
}

PDeltaRule rule_for(const Problem& stream) {
  return {stream.n_units, stream.targets, stream.n_groups};
}

/// Presents a stream, and expects counts, potentials and bits to be those of plain training.
void expect_online_bits_of_plain_training(const Problem& problem) {
  const auto plain_layer = testing::layer_for(problem);
  const auto layer = testing::layer_for(problem);
  auto plain = testing::trainer_for(problem, plain_layer, TrainingForm::plain);
  OnlineLayer online(layer);
  std::vector<std::int32_t> expected(problem.bins.size() / problem.code->n_inputs() *
                                     problem.n_units);
  auto potentials = expected;
  for (const auto& order : problem.orders) {
    const Problem stream = stream_of(problem, order);
    PDeltaRule rule = rule_for(stream);
    const auto expected_counts = plain.present(order);
    const auto counts = online.present(stream.bins, rule);
    ASSERT_EQ(counts.n_samples, expected_counts.n_samples);
    ASSERT_EQ(counts.n_units, expected_counts.n_units);
    plain_layer->potentials(problem.bins, 1, expected);
    online.potentials(problem.bins, potentials);
    ASSERT_EQ(potentials, expected);
  }
  online.synchronize();
  ASSERT_EQ(testing::parameters_of(*layer), testing::parameters_of(*plain_layer));
}

TEST(OnlineLayer, HasTheBitsOfPlainTraining) {
  for (std::uint64_t seed = 0; seed < 100; ++seed)
    expect_online_bits_of_plain_training(testing::random_problem(seed));
  testing::on_every_instruction_set([](auto /*level*/) {
    for (std::uint64_t seed = 100; seed < 110; ++seed) {
      expect_online_bits_of_plain_training(testing::random_problem(seed));
    }
  });
}

// Training is stopped at several samples; then potentials and parameters are those before it.
TEST(OnlineLayer, AStoppedPresentationChangesNothing) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Problem problem = testing::random_problem(seed);
    const auto layer = testing::layer_for(problem);
    OnlineLayer online(layer);
    const Problem stream = stream_of(problem, problem.orders[0]);
    PDeltaRule rule = rule_for(stream);
    const auto before = testing::parameters_of(*layer);
    const auto n_samples = static_cast<int>(problem.orders[0].size());
    for (int stop = 0; stop < n_samples; stop += 1 + n_samples / 5) {
      {
        const testing::StopAt stopping(stop);
        EXPECT_THROW(online.present(stream.bins, rule), testing::StopError);
      }
      std::vector<std::int32_t> potentials(stream.bins.size() / problem.code->n_inputs() *
                                           problem.n_units);
      auto expected = potentials;
      online.potentials(stream.bins, potentials);
      layer->potentials(stream.bins, 1, expected);
      ASSERT_EQ(potentials, expected);
    }
    EXPECT_NO_THROW(OnlineLayer{layer});  // another copy of the weights changes nothing either
    online.synchronize();
    ASSERT_EQ(testing::parameters_of(*layer), before);
  }
}

// With weights at their limit, corrections towards no or all firing units increase some beyond it.
TEST(OnlineLayer, AnOverflowOfAWeightChangesNothing) {
  Problem problem = testing::random_problem(1);
  const std::size_t n_columns = problem.code->n_columns();
  constexpr std::int32_t kLargest = (1 << 14) - 1;  // in two bytes; a correction may exceed it
  const std::vector<std::int32_t> weights(problem.n_units * n_columns, kLargest);
  const std::vector<std::int32_t> thresholds(problem.n_units, 0);
  const auto layer = std::make_shared<estimators::ParallelPerceptron>(problem.code, problem.n_units,
                                                                      weights, thresholds);
  OnlineLayer online(layer);
  const auto before = testing::parameters_of(*layer);
  bool threw = false;
  for (const double target : {0.0, static_cast<double>(problem.n_units)}) {
    std::fill(problem.targets.begin(), problem.targets.end(), target);
    PDeltaRule rule = rule_for(problem);
    try {
      online.present(problem.bins, rule);
    } catch (const std::overflow_error&) {
      threw = true;
    }
  }
  EXPECT_TRUE(threw);
  online.synchronize();
  EXPECT_EQ(testing::parameters_of(*layer), before);
}

TEST(OnlineLayer, RefusesWeightsBeyond14BitsAndBadArguments) {
  const Problem problem = testing::random_problem(1);
  constexpr std::int32_t kTooLarge = 1 << 14;
  const std::vector<std::int32_t> weights(problem.n_units * problem.code->n_columns(), kTooLarge);
  const std::vector<std::int32_t> thresholds(problem.n_units, 0);
  EXPECT_THROW(OnlineLayer(std::make_shared<estimators::ParallelPerceptron>(
                   problem.code, problem.n_units, weights, thresholds)),
               std::invalid_argument);
  OnlineLayer online(testing::layer_for(problem));
  PDeltaRule rule = rule_for(problem);
  const std::size_t n_inputs = problem.code->n_inputs();
  // The rule has targets of all samples, the bins are those of a single one.
  EXPECT_THROW(online.present(std::span(problem.bins).first(n_inputs), rule),
               std::invalid_argument);
  PDeltaRule rule_of_more_units(2 * problem.n_units, problem.targets, problem.n_groups);
  EXPECT_THROW(online.present(problem.bins, rule_of_more_units), std::invalid_argument);
  std::vector<std::int32_t> bins = problem.bins;
  bins[0] = 1000;  // beyond the number of bins
  EXPECT_THROW(online.present(bins, rule), std::invalid_argument);
}

// An interruption point is where long work may be stopped; StopAt(0) stops at the first one.
TEST(Interruption, EndsTrainingInEveryFormAndPrediction) {
  const Problem problem = testing::random_problem(3);
  const auto layer = testing::layer_for(problem);
  for (const auto form : {TrainingForm::plain, TrainingForm::dual, TrainingForm::block}) {
    auto trainer = testing::trainer_for(problem, testing::layer_for(problem), form);
    const testing::StopAt stopping(0);
    EXPECT_THROW(trainer.present(problem.orders[0]), testing::StopError);
  }
  std::vector<std::int32_t> counts(problem.bins.size() / problem.code->n_inputs());
  const testing::StopAt stopping(0);
  EXPECT_THROW(testing::trainer_for(problem, layer, TrainingForm::dual), testing::StopError);
  testing::n_points_left = 0;  // to be stopped again, at the next point
  EXPECT_THROW(layer->counts(problem.bins, 1, 1, counts), testing::StopError);
}

}  // namespace
}  // namespace sdnn
