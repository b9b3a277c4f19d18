// A pass over the hidden layer of networks that learned for a while, beside plain loads of the
// lines that it reads, prefetched alike: no pass can be quicker. The first benchmarks of a size
// wait for its trial.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/detail/column_sums.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/instruction_set.hpp"
#include "sdnn/core/random.hpp"
#include "tools/trial.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif

namespace {

using namespace sdnn;
using Network = approximators::SDNNC;
using Trial = tools::AcrobotTrial<agents::QLearning<Network>>;

constexpr double kNoise = 0.02;
constexpr std::size_t kStates = 64;

/// The networks after 300 and after 7,500 episodes, which differ in the size of their weights.
const Network& learned(int n_inputs, int n_episodes) {
  static std::map<std::pair<int, int>, std::unique_ptr<const Network>> networks;
  auto& network = networks[{n_inputs, n_episodes}];
  if (!network) {
    Trial trial(agents::QLearning(Network({.n_inputs = n_inputs}, 1), {}, 1), {}, {},
                {.n_sensors = n_inputs, .noise = kNoise}, {}, 1);
    trial.advance(n_episodes);
    network = std::make_unique<const Network>(trial.agent().networks().front());
  }
  return *network;
}

std::vector<double> random_state(const Network& network, core::Random& random) {
  std::vector<double> state(network.n_inputs());
  for (double& x : state) x = random.uniform();
  return state;
}

/// The columns of random states.
class Lists {
 public:
  explicit Lists(const Network& network) {
    const coding::StateCode& code = network.state_code();
    core::Random random(2, core::Stream::exploration);
    std::vector<coding::Bin> bins(network.n_inputs());
    std::vector<std::uint64_t> words(2 * code.n_words());
    const coding::TernaryCode ternary{words.data(), words.data() + code.n_words()};
    lists_.assign(kStates, code.column_lists());
    for (coding::ColumnLists& lists : lists_) {
      code.bins_of(random_state(network, random), bins);
      code.encode(bins, words.data(), words.data() + code.n_words());
      lists.read(ternary);
      columns_.push_back(lists.columns());
    }
  }

  /// Returns the columns of the next state.
  const coding::SignedColumns& next() { return columns_[next_++ % kStates]; }

 private:
  std::vector<coding::ColumnLists> lists_;
  std::vector<coding::SignedColumns> columns_;
  std::size_t next_ = 0;
};

/// Forces the instruction set of the first argument, as long as it lives.
class Level {
 public:
  explicit Level(benchmark::State& state) {
    const auto level = static_cast<core::InstructionSet>(state.range(0));
    is_there_ = core::offers(level);
    if (is_there_) {
      core::set_instruction_set(core::name_of(level));
      state.SetLabel(std::string(core::name_of(level)));
    } else {
      state.SkipWithError("this processor does not offer the instruction set");
    }
  }
  ~Level() { core::set_instruction_set(before_); }

  bool is_there() const noexcept { return is_there_; }

 private:
  std::string before_{core::name_of(core::instruction_set())};
  bool is_there_;
};

// The arguments of all: level of the instruction set, inputs, learning episodes.

/// All action values of a new state.
void new_state(benchmark::State& state) {
  const Level level(state);
  if (!level.is_there()) return;
  const Network& network =
      learned(static_cast<int>(state.range(1)), static_cast<int>(state.range(2)));
  auto workspace = network.workspace();
  std::vector<double> values(network.n_actions());
  core::Random random(3, core::Stream::exploration);
  for (auto _ : state) {
    network.values(random_state(network, random), workspace, values);
    benchmark::DoNotOptimize(values.data());
  }
}

/// The potentials of all units, from a list of columns.
void pass(benchmark::State& state) {
  const Level level(state);
  if (!level.is_there()) return;
  const Network& network =
      learned(static_cast<int>(state.range(1)), static_cast<int>(state.range(2)));
  Lists lists(network);
  std::vector<std::int32_t> out(network.hidden_layer().n_units());
  for (auto _ : state) {
    network.hidden_layer().potentials(lists.next(), out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  state.counters["high"] = static_cast<double>(network.hidden_layer().n_high_bytes());
}

namespace detail {

using approximators::ColumnPlaces;
using approximators::detail::Bytes;

inline void add_lines_portable(const std::int8_t* block, const ColumnPlaces& places, Bytes& sum) {
  const std::uint32_t* const end = places.data() + places.size();
  for (const std::uint32_t* place = places.data(); place != end; place += 4) {
    const Bytes four = approximators::detail::group_sum_portable<4>(block, place);
    for (std::size_t i = 0; i < four.size(); ++i)
      sum[i] = static_cast<std::int8_t>(sum[i] + four[i]);
  }
}

#if SDNN_X86_KERNELS

using approximators::detail::prefetch_ahead;

[[SDNN_TARGET_AVX2]] inline void add_lines_avx2(const std::int8_t* block,
                                                const ColumnPlaces& places, Bytes& sum) {
  using approximators::detail::group_sum_avx2;
  __m256i sums[2] = {};
  const std::uint32_t* const end = places.data() + places.size();
  for (const std::uint32_t* place = places.data(); place != end; place += 8) {
    prefetch_ahead(block, place);
    sums[0] = _mm256_add_epi8(sums[0], group_sum_avx2(block, place, 8, 0));
    sums[1] = _mm256_add_epi8(sums[1], group_sum_avx2(block, place, 8, 1));
  }
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(sum.data()), _mm256_add_epi8(sums[0], sums[1]));
}

[[SDNN_TARGET_AVX512]] inline void add_lines_avx512(const std::int8_t* block,
                                                    const ColumnPlaces& places, Bytes& sum) {
  using approximators::detail::group_sum_avx512;
  __m512i sums[2] = {};
  const std::uint32_t* const end = places.data() + places.size();
  for (const std::uint32_t* place = places.data(); place != end; place += 8) {
    prefetch_ahead(block, place);
    sums[0] = _mm512_add_epi8(sums[0], group_sum_avx512(block, place, 4));
    sums[1] = _mm512_add_epi8(sums[1], group_sum_avx512(block, place + 4, 4));
  }
  _mm512_storeu_si512(sum.data(), _mm512_add_epi8(sums[0], sums[1]));
}

#endif  // SDNN_X86_KERNELS

}  // namespace detail

SDNN_KERNEL_NEON(void, add_lines,
                 (const std::int8_t* block, const detail::ColumnPlaces& places, detail::Bytes& sum),
                 (block, places, sum))

/// Loads the lines of columns, 64 bytes each; their sums modulo 256 make sure that it does.
SDNN_DISPATCH(void, add_lines,
              (const std::int8_t* block, const detail::ColumnPlaces& places, detail::Bytes& sum),
              (block, places, sum))

/// Loads of the lines that the pass reads, without those of high bytes.
void plain_loads(benchmark::State& state) {
  const Level level(state);
  if (!level.is_there()) return;
  const Network& network =
      learned(static_cast<int>(state.range(1)), static_cast<int>(state.range(2)));
  Lists lists(network);
  const std::size_t n_blocks = network.hidden_layer().n_blocks();
  const std::size_t block_bytes =
      (network.hidden_layer().n_columns() + 1) * approximators::kBlockUnits;
  core::AlignedBuffer<std::int8_t> weights(n_blocks * block_bytes);
  std::ranges::fill(weights.span(), 1);  // pages that are never written share one
  detail::Bytes sum{};
  for (auto _ : state) {
    const coding::SignedColumns& columns = lists.next();
    for (const auto list : {columns.plus, columns.minus}) {
      const approximators::ColumnPlaces places(list, network.hidden_layer().n_columns());
      for (std::size_t block = 0; block < n_blocks; ++block) {
        add_lines(weights.data() + block * block_bytes, places, sum);
        benchmark::DoNotOptimize(sum);
      }
    }
  }
}

void for_all(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"level", "inputs", "episodes"})
      ->ArgsProduct({{0, 1, 2, 3}, {4, 6}, {300, 7500}})
      ->Unit(benchmark::kMicrosecond);
}
BENCHMARK(new_state)->Apply(for_all);
BENCHMARK(pass)->Apply(for_all);
BENCHMARK(plain_loads)->Apply(for_all);

}  // namespace
