// Runs one kernel a given number of times, on a given instruction set: count_instructions.py runs
// it in an emulator, which counts instructions and tells nothing of their time.
//
// usage: passes KERNEL LEVEL N

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/core/instruction_set.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/environments/acrobot_batch.hpp"
#include "sdnn/estimators/detail/signed_sums.hpp"
#include "tools/stopwatch.hpp"
#include "tools/yardsticks.hpp"

namespace {

using namespace sdnn;

constexpr std::size_t kUnits = 900;
constexpr std::size_t kColumns = 2400;  // 4 inputs of 200 units in pairs

core::Random random_numbers() { return {1, core::Stream::exploration}; }

/// The hidden pass at a random state: a quarter of the columns +1, a quarter -1.
void hidden_pass(int n) {
  core::Random random = random_numbers();
  approximators::HiddenLayer layer(kUnits, kColumns);
  for (std::size_t i = 0; i < kUnits; ++i) {
    for (std::size_t j = 0; j < kColumns; ++j) {
      layer.set_weight(i, j, static_cast<std::int32_t>(random.below(101)) - 50);
    }
  }
  std::vector<std::uint32_t> plus;
  std::vector<std::uint32_t> minus;
  for (std::uint32_t j = 0; j < kColumns; ++j) {
    if (random.below(2) == 0) (random.below(2) == 0 ? plus : minus).push_back(j);
  }
  std::vector<std::int32_t> potentials(kUnits);
  for (int i = 0; i < n; ++i) {
    layer.potentials({plus, minus}, potentials);
    tools::keep(potentials[0]);
  }
}

/// A dense product of 32-bit floats of the same shape.
void dense_product(int n) {
  const std::vector<float> weights(kUnits * kColumns, 0.5F);
  const std::vector<float> input(kColumns, 1.0F);
  std::vector<float> out(kUnits);
  for (int i = 0; i < n; ++i) {
    tools::multiply(weights.data(), kUnits, kColumns, input.data(), out.data());
    tools::keep(out[0]);
  }
}

/// The inner product of two codes, as training in dual form takes it for each pair of samples.
void inner_product(int n) {
  core::Random random = random_numbers();
  constexpr std::size_t kWords = (kColumns + 63) / 64 + 2;
  std::vector<std::uint64_t> words(4 * kWords);
  for (auto& word : words) word = random.below(~std::uint64_t{0});
  const coding::TernaryCode one{words.data(), words.data() + kWords};
  const coding::TernaryCode other{words.data() + 2 * kWords, words.data() + 3 * kWords};
  for (int i = 0; i < n; ++i) tools::keep(coding::inner_product(one, other, kWords));
}

/// Steps 64 acrobots through a decision interval.
void acrobots(int n) {
  constexpr std::size_t kAcrobots = 64;
  environments::AcrobotBatch batch({}, kAcrobots);
  const std::vector<double> torques(kAcrobots, 3.0);
  const std::vector<double> tolerances(kAcrobots, 0.0);
  const std::vector<std::uint8_t> moving(kAcrobots, 1);
  std::vector<double> rewards(kAcrobots);
  std::vector<std::uint8_t> terminated(kAcrobots);
  std::vector<std::uint8_t> truncated(kAcrobots);
  for (int i = 0; i < n; ++i) {
    batch.step(torques, tolerances, moving, {rewards, terminated, truncated});
  }
}

/// The estimators' sums of a hundred rows of 960 weights of 16 bits.
void signed_sums(int n) {
  constexpr std::size_t kRows = 100;
  constexpr std::size_t kSize = 960;
  const std::vector<std::int16_t> weights(kRows * kSize, 1);
  estimators::SignedRows<std::int16_t> rows;
  for (std::size_t k = 0; k < kRows; ++k) rows.add(weights.data() + k * kSize, k % 2 == 0 ? 1 : -1);
  std::vector<std::int32_t> to(kSize);
  for (int i = 0; i < n; ++i) {
    estimators::add_signed(to.data(), kSize, rows, 0, std::size_t{1} << 15);
    tools::keep(to[0]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: passes KERNEL LEVEL N\n");
    return 2;
  }
  const std::string kernel = argv[1];
  core::set_instruction_set(argv[2]);
  const int n = std::atoi(argv[3]);
  if (kernel == "hidden_pass") {
    hidden_pass(n);
  } else if (kernel == "dense_product") {
    dense_product(n);
  } else if (kernel == "inner_product") {
    inner_product(n);
  } else if (kernel == "acrobots") {
    acrobots(n);
  } else if (kernel == "signed_sums") {
    signed_sums(n);
  } else {
    std::fprintf(stderr, "no kernel is called %s\n", argv[1]);
    return 2;
  }
  return 0;
}
