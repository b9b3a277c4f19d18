/// Random training problems, and the weights that a form leaves.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/estimators/trainer.hpp"

namespace sdnn::testing {

struct Problem {
  std::shared_ptr<const coding::SelectiveDesensitization> code;
  std::size_t n_units = 0, n_groups = 1;
  std::vector<std::int32_t> bins;
  std::vector<double> targets;
  std::vector<std::vector<std::int32_t>> orders;
};

inline coding::PatternTable random_table(std::size_t n_bins, std::size_t n_units,
                                         core::Random& random) {
  coding::PatternTable table(n_bins, n_units);
  for (std::size_t bin = 0; bin < n_bins; ++bin) {
    for (std::size_t k = 0; k < n_units; ++k) {
      if (random.below(2) == 1) table.flip(bin, k);
    }
  }
  return table;
}

/// A problem of random size: patterns need 1 to 3 words, and units 1 to 3 tiles. Some targets are
/// below 0 or above the size of a group, and are clipped.
inline Problem random_problem(std::uint64_t seed) {
  core::Random random(seed, core::Stream::exploration);
  const std::size_t n_inputs = 1 + random.below(3), n_bins = 1 + random.below(12);
  const std::size_t n_pattern_units = 1 + random.below(150);
  std::vector<coding::InputPair> pairs;
  for (std::size_t i = 0; i < n_inputs; ++i) {
    for (std::size_t j = 0; j < n_inputs; ++j) {
      if (i != j || n_inputs == 1) pairs.push_back({i, j});
    }
  }
  std::vector<coding::PatternTable> modified, modifiers;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    modified.push_back(random_table(n_bins, n_pattern_units, random));
    modifiers.push_back(random_table(n_bins, n_pattern_units, random));
  }
  Problem problem;
  problem.code = std::make_shared<coding::SelectiveDesensitization>(
      std::move(modified), std::move(modifiers), std::move(pairs));
  problem.n_groups = 1 + random.below(3);
  const std::size_t group = 1 + random.below(70);
  problem.n_units = problem.n_groups * group;
  const std::size_t n_samples = 1 + random.below(150);
  for (std::size_t i = 0; i < n_samples * n_inputs; ++i) {
    problem.bins.push_back(static_cast<std::int32_t>(random.below(n_bins)));
  }
  for (std::size_t i = 0; i < n_samples * problem.n_groups; ++i) {
    problem.targets.push_back(random.uniform() * (static_cast<double>(group) + 2.0) - 1.0);
  }
  for (int epoch = 0; epoch < 4; ++epoch) {
    auto& order = problem.orders.emplace_back(1 + random.below(2 * n_samples));
    for (auto& index : order) index = static_cast<std::int32_t>(random.below(n_samples));
  }
  return problem;
}

inline std::shared_ptr<estimators::ParallelPerceptron> layer_for(const Problem& problem) {
  constexpr std::uint64_t kSeed = 7;
  return std::make_shared<estimators::ParallelPerceptron>(problem.code, problem.n_units, kSeed);
}

inline estimators::PDeltaTrainer trainer_for(const Problem& problem,
                                             std::shared_ptr<estimators::ParallelPerceptron> layer,
                                             estimators::TrainingForm form, int n_threads = 1) {
  constexpr std::size_t kMemoryLimit = std::size_t{1} << 30;  // enough for every form
  return {std::move(layer),
          problem.bins,
          estimators::PDeltaRule(problem.n_units, problem.targets, problem.n_groups),
          form,
          kMemoryLimit,
          n_threads};
}

/// The problem with other samples, of which there are `n_samples`.
inline Problem with_samples(Problem problem, std::size_t n_samples, std::uint64_t seed) {
  core::Random random(seed, core::Stream::exploration);
  const std::size_t n_bins = problem.code->n_bins(0);
  problem.bins.resize(n_samples * problem.code->n_inputs());
  for (auto& bin : problem.bins) bin = static_cast<std::int32_t>(random.below(n_bins));
  problem.targets.resize(n_samples * problem.n_groups);
  for (double& target : problem.targets) target = random.uniform() * 9.0;
  return problem;
}

/// All thresholds, then all weights, unit by unit.
inline std::vector<std::int32_t> parameters_of(const estimators::ParallelPerceptron& layer) {
  std::vector<std::int32_t> parameters(layer.thresholds().begin(), layer.thresholds().end());
  for (std::size_t i = 0; i < layer.n_units(); ++i) {
    for (std::size_t j = 0; j < layer.code().n_columns(); ++j) {
      parameters.push_back(layer.weight(i, j));
    }
  }
  return parameters;
}

/// Expects the form's bits and counts to be those of plain training, epoch by epoch.
inline void expect_bits_of_plain_training(const Problem& problem, estimators::TrainingForm form,
                                          int n_threads) {
  const auto plain_layer = layer_for(problem);
  const auto layer = layer_for(problem);
  auto plain = trainer_for(problem, plain_layer, estimators::TrainingForm::plain);
  auto trainer = trainer_for(problem, layer, form, n_threads);
  for (std::size_t epoch = 0; epoch < problem.orders.size(); ++epoch) {
    const auto expected = plain.present(problem.orders[epoch]);
    const auto corrections = trainer.present(problem.orders[epoch]);
    ASSERT_EQ(corrections.n_samples, expected.n_samples);
    ASSERT_EQ(corrections.n_units, expected.n_units);
    if (epoch % 2 == 0) continue;  // synchronized in the middle and at the end
    trainer.synchronize();
    ASSERT_EQ(parameters_of(*layer), parameters_of(*plain_layer));
  }
}

/// Expects these bits on random problems, with one to three threads, and on every instruction set.
inline void expect_bits_of_plain_training_on_random_problems(estimators::TrainingForm form) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    SCOPED_TRACE(seed);
    expect_bits_of_plain_training(random_problem(seed), form, 1 + static_cast<int>(seed % 3));
  }
  on_every_instruction_set([&](auto level) {
    SCOPED_TRACE(level);
    for (std::uint64_t seed = 200; seed < 220; ++seed) {
      expect_bits_of_plain_training(random_problem(seed), form, /*n_threads=*/1);
    }
  });
}

/// The problem with `n_rounds` epochs in the order of the data; with `at_once`, each of its orders
/// repeats the data `n_rounds` times instead.
inline Problem in_data_order(Problem problem, std::size_t n_rounds, bool at_once = false) {
  const std::size_t n_samples = problem.bins.size() / problem.code->n_inputs();
  for (auto& order : problem.orders) {
    order.clear();
    for (std::size_t t = 0; t < (at_once ? n_rounds : 1) * n_samples; ++t) {
      order.push_back(static_cast<std::int32_t>(t % n_samples));
    }
  }
  while (!at_once && problem.orders.size() < n_rounds) {
    problem.orders.push_back(problem.orders.back());
  }
  return problem;
}

}  // namespace sdnn::testing
