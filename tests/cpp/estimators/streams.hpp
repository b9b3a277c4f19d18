/// Predictions of regressions that learn from a stream, and the largest number that they may meet.
#pragma once

#include <limits>
#include <vector>

namespace sdnn::testing {

inline constexpr double kMax = std::numeric_limits<double>::max();

/// The first output.
template <class Model>
double predicted(const Model& model, const std::vector<double>& inputs) {
  std::vector<double> outputs(model.n_outputs());
  model.predict(inputs, outputs);
  return outputs[0];
}

}  // namespace sdnn::testing
