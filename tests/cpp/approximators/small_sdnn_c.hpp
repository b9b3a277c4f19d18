/// A small SDNN-C, and functions that read and compare it.
#pragma once

#include <gtest/gtest.h>

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "approximators/with_workspace.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::approximators::small_sdnn_c {

using Network = testing::WithWorkspace<SDNNC>;
using testing::random_state;
using State = std::vector<double>;

/// The learning tests run on a smaller network, which has the same parts.
inline SDNNCConfig small_config() {
  return {.n_inputs = 3, .n_pattern_units = 50, .n_hidden_units = 200, .n_active_units = 60};
}

inline std::vector<double> values(Network& network, const State& state) {
  std::vector<double> out(network.n_actions());
  network.values(state, out);
  return out;
}

inline std::vector<std::int32_t> potentials(const Network& network, const State& state) {
  std::vector<std::int32_t> out(network.hidden_layer().n_units());
  network.potentials(state, out);
  return out;
}

/// Q(s, a) of every action from a full pass and window masks, without caches and sliding counts.
inline std::vector<double> values_by_masks(const Network& network, const State& state) {
  using Mask = std::bitset<1024>;
  const std::vector<std::int32_t> h = potentials(network, state);
  Mask hidden;
  for (std::size_t i = 0; i < h.size(); ++i) hidden[i] = h[i] > 0;
  const coding::ActionCode& code = network.action_code();
  std::vector<double> out(code.n_actions());
  for (std::size_t action = 0; action < code.n_actions(); ++action) {
    const Mask window = (~Mask{} >> (1024 - code.n_active_units())) << code.first_unit(action);
    out[action] = network.output_scale()(static_cast<int>((hidden & window).count()));
  }
  return out;
}

inline void expect_equal_parameters(const Network& a, const Network& b) {
  const HiddenLayer& p = a.hidden_layer();
  const HiddenLayer& q = b.hidden_layer();
  std::size_t n_different = 0;
  for (std::size_t i = 0; i < p.n_units(); ++i) {
    n_different += p.threshold(i) != q.threshold(i);
    for (std::size_t j = 0; j < a.state_code().n_columns(); ++j) {
      n_different += a.weight(i, j) != b.weight(i, j);
    }
  }
  EXPECT_EQ(n_different, 0U);
}

}  // namespace sdnn::approximators::small_sdnn_c
