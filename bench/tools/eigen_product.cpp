// The dense product that `sdnn bench` compares with, beside Eigen's: it must not be the slower one.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <cstddef>

#include "tools/yardsticks.hpp"

namespace {

constexpr int kUnits = 900;

void own_product(benchmark::State& state) {
  sdnn::tools::DenseProduct product(kUnits, static_cast<std::size_t>(state.range(0)), 1);
  for (auto _ : state) benchmark::DoNotOptimize(product.multiply().data());
  state.SetBytesProcessed(state.iterations() * state.range(0) * kUnits * 4);
}
BENCHMARK(own_product)->ArgName("columns")->Arg(2400)->Arg(6000)->Unit(benchmark::kMicrosecond);

template <int Order>
void eigen_product(benchmark::State& state) {
  const Eigen::Index n_columns = state.range(0);
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Order>;
  const Matrix weights = Matrix::Random(kUnits, n_columns);
  const Eigen::VectorXf input = Eigen::VectorXf::Random(n_columns);
  Eigen::VectorXf out(kUnits);
  for (auto _ : state) {
    out.noalias() = weights * input;
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * n_columns * kUnits * 4);
}
BENCHMARK(eigen_product<Eigen::RowMajor>)
    ->ArgName("columns")
    ->Arg(2400)
    ->Arg(6000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(eigen_product<Eigen::ColMajor>)
    ->ArgName("columns")
    ->Arg(2400)
    ->Arg(6000)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
