/// A dense matrix-vector product, with whose time the network's is compared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/random.hpp"
#include "tools/stopwatch.hpp"

namespace sdnn::tools {

namespace detail {

SDNN_WIDE_VECTORS_BEGIN

/// Implements multiply, below, for four rows at a time, so that a piece of the input is loaded once
/// for all of them.
SDNN_INLINE void multiply_body(const float* weights, std::size_t n_rows, std::size_t n_columns,
                               const float* input, float* out) noexcept {
  std::size_t i = 0;
#if SDNN_LANES
  constexpr std::size_t kRows = 4, kLanes = 8;
  typedef float Vector __attribute__((vector_size(kLanes * sizeof(float))));
  for (; i + kRows <= n_rows; i += kRows) {
    const float* const rows = weights + i * n_columns;
    Vector sums[kRows] = {};
    std::size_t j = 0;
    for (; j + kLanes <= n_columns; j += kLanes) {
      Vector x;
      std::memcpy(&x, input + j, sizeof x);
      core::unrolled<kRows>([&](std::size_t r) SDNN_INLINE_LAMBDA {
        Vector row;
        std::memcpy(&row, rows + r * n_columns + j, sizeof row);
        sums[r] += row * x;
      });
    }
    for (std::size_t r = 0; r < kRows; ++r) {
      float sum = 0.0F;
      for (std::size_t k = j; k < n_columns; ++k) sum += rows[r * n_columns + k] * input[k];
      for (std::size_t k = 0; k < kLanes; ++k) sum += sums[r][k];
      out[i + r] = sum;
    }
  }
#endif
  for (; i < n_rows; ++i) {
    float sum = 0.0F;
    for (std::size_t j = 0; j < n_columns; ++j) sum += weights[i * n_columns + j] * input[j];
    out[i] = sum;
  }
}

SDNN_WIDE_VECTORS_END

}  // namespace detail

/// Computes the product out = weights . input in 32-bit floats. Shapes: weights (n_rows,
/// n_columns), input (n_columns,), out (n_rows,).
SDNN_KERNEL(void, multiply,
            (const float* weights, std::size_t n_rows, std::size_t n_columns, const float* input,
             float* out),
            (weights, n_rows, n_columns, input, out))

/// A dense float32 matrix-vector product, as the hidden layer of an ordinary network computes it.
/// Its time is a yardstick for the network's.
///
/// The instruction set is chosen at run time, as for the kernels of the network; that of Eigen's
/// product depends on the options of the compilation. `bench/` compares the two.
class DenseProduct {
 public:
  /// Draws weights and input, uniform in [-1, 1). Throws std::invalid_argument, std::bad_alloc.
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

  /// Computes the product, which is valid until the next call. Shape: (n_rows,).
  std::span<const float> multiply() {
    tools::multiply(weights_.data(), n_rows_, n_columns_, input_.data(), out_.data());
    return out_.span();
  }

  /// Times `n_repetitions` products.
  Times run(int n_repetitions) {
    return time_each(n_repetitions, [this](int) { keep(multiply()[0]); });
  }

 private:
  static float draw(core::Random& random) {
    return static_cast<float>(2.0 * random.uniform() - 1.0);
  }

  std::size_t n_rows_, n_columns_;
  core::AlignedBuffer<float> weights_, input_, out_;
};

}  // namespace sdnn::tools
