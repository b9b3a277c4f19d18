/// A good dense product, to compare with.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"
#include "sdnn/core/random.hpp"
#include "tools/stopwatch.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif
#if SDNN_NEON_KERNELS
#include <arm_neon.h>
#endif

namespace sdnn::tools {

namespace detail {

inline void multiply_portable(const float* weights, std::size_t n_rows, std::size_t n_columns,
                              const float* input, float* out) noexcept {
  constexpr std::size_t kLanes = 16;
  for (std::size_t i = 0; i < n_rows; ++i) {
    const float* const row = weights + i * n_columns;
    std::array<float, kLanes> sums{};
    std::size_t j = 0;
    for (; j + kLanes <= n_columns; j += kLanes) {
      for (std::size_t k = 0; k < kLanes; ++k) sums[k] += row[j + k] * input[j + k];
    }
    float sum = 0.0F;
    for (; j < n_columns; ++j) sum += row[j] * input[j];
    for (const float lane : sums) sum += lane;
    out[i] = sum;
  }
}

#if SDNN_X86_KERNELS

/// Eight rows at a time, so that a piece of the input is loaded once for all of them.
[[gnu::target("avx2,fma")]] inline void multiply_fma(const float* weights, std::size_t n_rows,
                                                     std::size_t n_columns, const float* input,
                                                     float* out) noexcept {
  constexpr std::size_t kRows = 8;
  constexpr std::size_t kLanes = 8;
  const std::size_t whole_rows = n_rows - n_rows % kRows;
  for (std::size_t i = 0; i < whole_rows; i += kRows) {
    const float* const rows = weights + i * n_columns;
    __m256 sums[kRows];
    for (__m256& sum : sums) sum = _mm256_setzero_ps();
    std::size_t j = 0;
    for (; j + kLanes <= n_columns; j += kLanes) {
      const __m256 x = _mm256_loadu_ps(input + j);
      for (std::size_t r = 0; r < kRows; ++r) {
        sums[r] = _mm256_fmadd_ps(_mm256_loadu_ps(rows + r * n_columns + j), x, sums[r]);
      }
    }
    for (std::size_t r = 0; r < kRows; ++r) {
      alignas(32) std::array<float, kLanes> lanes;
      _mm256_store_ps(lanes.data(), sums[r]);
      float sum = 0.0F;
      for (std::size_t rest = j; rest < n_columns; ++rest) {
        sum += rows[r * n_columns + rest] * input[rest];
      }
      for (const float lane : lanes) sum += lane;
      out[i + r] = sum;
    }
  }
  multiply_portable(weights + whole_rows * n_columns, n_rows - whole_rows, n_columns, input,
                    out + whole_rows);
}

/// No processor is known to have AVX2 without fused multiply-adds, but one may.
inline void multiply_avx2(const float* weights, std::size_t n_rows, std::size_t n_columns,
                          const float* input, float* out) noexcept {
  const auto multiply = __builtin_cpu_supports("fma") ? multiply_fma : multiply_portable;
  multiply(weights, n_rows, n_columns, input, out);
}

inline void multiply_avx512(const float* weights, std::size_t n_rows, std::size_t n_columns,
                            const float* input, float* out) noexcept {
  multiply_avx2(weights, n_rows, n_columns, input, out);
}

#endif  // SDNN_X86_KERNELS

#if SDNN_NEON_KERNELS

/// sum + a * b, by one instruction.
inline float32x4_t fused(float32x4_t sum, float32x4_t a, float32x4_t b) noexcept {
#if defined(__ARM_FEATURE_FMA)
  return vfmaq_f32(sum, a, b);
#else
  return vmlaq_f32(sum, a, b);
#endif
}

/// Eight rows at a time, as multiply_fma.
inline void multiply_neon(const float* weights, std::size_t n_rows, std::size_t n_columns,
                          const float* input, float* out) noexcept {
  constexpr std::size_t kRows = 8;
  constexpr std::size_t kLanes = 4;
  const std::size_t whole_rows = n_rows - n_rows % kRows;
  for (std::size_t i = 0; i < whole_rows; i += kRows) {
    const float* const rows = weights + i * n_columns;
    float32x4_t sums[kRows] = {};
    std::size_t j = 0;
    for (; j + kLanes <= n_columns; j += kLanes) {
      const float32x4_t x = vld1q_f32(input + j);
      for (std::size_t r = 0; r < kRows; ++r) {
        sums[r] = fused(sums[r], vld1q_f32(rows + r * n_columns + j), x);
      }
    }
    for (std::size_t r = 0; r < kRows; ++r) {
      std::array<float, kLanes> lanes;
      vst1q_f32(lanes.data(), sums[r]);
      float sum = 0.0F;
      for (std::size_t rest = j; rest < n_columns; ++rest) {
        sum += rows[r * n_columns + rest] * input[rest];
      }
      for (const float lane : lanes) sum += lane;
      out[i + r] = sum;
    }
  }
  multiply_portable(weights + whole_rows * n_columns, n_rows - whole_rows, n_columns, input,
                    out + whole_rows);
}

#endif  // SDNN_NEON_KERNELS

}  // namespace detail

/// out = weights . input, in 32-bit floats; the only kernel whose bits depend on the level. Shapes:
/// weights (n_rows, n_columns), input (n_columns,), out (n_rows,).
SDNN_DISPATCH(void, multiply,
              (const float* weights, std::size_t n_rows, std::size_t n_columns, const float* input,
               float* out),
              (weights, n_rows, n_columns, input, out))

/// A dense float32 matrix-vector product, as quick as the processor makes it: what a hidden layer
/// of this size costs in an ordinary network.
///
/// Eigen's product depends on the options of the compilation; this one is chosen at run time, like
/// the kernels of the network. `bench/` compares the two.
class DenseProduct {
 public:
  /// Weights and input uniform in [-1, 1). Throws std::invalid_argument, std::bad_alloc.
  DenseProduct(std::size_t n_rows, std::size_t n_columns, std::uint64_t seed)
      : n_rows_(n_rows), n_columns_(n_columns) {
    core::require_in_range("n_rows", n_rows, std::size_t{1}, std::size_t{1} << 20);
    core::require_in_range("n_columns", n_columns, std::size_t{1}, std::size_t{1} << 20);
    weights_ = core::AlignedBuffer<float>(n_rows * n_columns);
    input_ = core::AlignedBuffer<float>(n_columns);
    out_ = core::AlignedBuffer<float>(n_rows);
    core::Random random(seed, core::Stream::weights);
    for (float& weight : weights_.span()) weight = draw(random);
    for (float& value : input_.span()) value = draw(random);
  }

  std::span<const float> weights() const noexcept { return weights_.span(); }  ///< row by row
  std::span<const float> input() const noexcept { return input_.span(); }

  /// The product; valid until the next call. Shape: (n_rows,).
  std::span<const float> multiply() {
    tools::multiply(weights_.data(), n_rows_, n_columns_, input_.data(), out_.data());
    return out_.span();
  }

  /// Times of `n_repetitions` products.
  Times run(int n_repetitions) {
    return time_each(n_repetitions, [this](int) { keep(multiply()[0]); });
  }

 private:
  static float draw(core::Random& random) {
    return static_cast<float>(2.0 * random.uniform() - 1.0);
  }

  std::size_t n_rows_;
  std::size_t n_columns_;
  core::AlignedBuffer<float> weights_;
  core::AlignedBuffer<float> input_;
  core::AlignedBuffer<float> out_;
};

}  // namespace sdnn::tools
