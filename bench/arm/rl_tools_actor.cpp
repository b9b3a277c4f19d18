// The actor of rl-tools' TD3 for Pendulum-v1: 3 inputs, two layers of 64 units, an action. Its
// weights are bytes of model.h's rows; how fast it is does not depend on them where floating point
// has hardware.
#include <rl_tools/nn/layers/dense/operations_arm/opt.h>
#include <rl_tools/nn/layers/dense/operations_generic.h>
#include <rl_tools/nn_models/mlp/operations_generic.h>
#include <rl_tools/nn_models/sequential/operations_generic.h>
#include <rl_tools/operations/arm.h>

#include "weights.h"

namespace {
namespace rlt = rl_tools;
using Device = rlt::devices::DefaultARM;
using Index = Device::index_t;
using Numbers = rlt::numeric_types::Policy<float>;
constexpr Index kInputs = 3;
using InputShape = rlt::tensor::Shape<Index, 1, 1, kInputs>;
using OutputShape = rlt::tensor::Shape<Index, 1, 1, 1>;
using Actor = rlt::nn_models::mlp::BindConfiguration<rlt::nn_models::mlp::Configuration<
    Numbers, Index, 1, 3, 64, rlt::nn::activation_functions::RELU,
    rlt::nn::activation_functions::TANH>>;
using Model =
    rlt::nn_models::sequential::Build<rlt::nn::capability::Forward<false>,
                                      rlt::nn_models::sequential::Module<Actor>, InputShape>;
static_assert(sizeof(Model) <= sizeof weights);

Device device;
Model::Buffer<false> buffer;
Device::SPEC::RANDOM::ENGINE<> random_engine;
rlt::Tensor<rlt::tensor::Specification<float, Index, InputShape, false>> input;
rlt::Tensor<rlt::tensor::Specification<float, Index, OutputShape, false>> output;
}  // namespace

extern "C" float act(const float* observation) {
  for (Index i = 0; i < kInputs; ++i) rlt::set(device, input, observation[i], 0, 0, i);
  rlt::evaluate(device, *reinterpret_cast<const Model*>(weights), input, output, buffer,
                random_engine, rlt::Mode<rlt::mode::Evaluation<>>{});
  return rlt::get(device, output, 0, 0, 0);
}
