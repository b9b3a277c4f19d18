/// Exact action values of finitely many states: what agents are tested against.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "sdnn/approximators/action_value.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::testing {

/// A table Q(cell, action) over [0, 1]^l, every input cut into `n_cells` equal half-open parts.
///
/// A correction writes (1 - rate) Q + rate target exactly.
class LookupTable {
 public:
  LookupTable(std::size_t n_inputs, std::size_t n_cells, std::size_t n_actions)
      : n_inputs_(n_inputs), n_cells_(n_cells), n_actions_(n_actions) {
    std::size_t size = n_actions;
    for (std::size_t i = 0; i < n_inputs; ++i) size *= n_cells;
    table_.assign(size, 0.0);
  }

  std::size_t n_inputs() const noexcept { return n_inputs_; }
  std::size_t n_actions() const noexcept { return n_actions_; }

  struct Workspace {};  // there is nothing to remember
  Workspace workspace() const noexcept { return {}; }

  void values(std::span<const double> state, std::span<double> out) const {
    std::copy_n(&table_[row(state)], n_actions_, out.begin());
  }
  void values(std::span<const double> state, Workspace&, std::span<double> out) const {
    values(state, out);
  }
  double value(std::span<const double> state, Workspace&, std::size_t action) const {
    return value(state, action);
  }
  void update(std::span<const double> state, Workspace&, std::size_t action, double target,
              double rate) {
    update(state, action, target, rate);
  }
  double value(std::span<const double> state, std::size_t action) const {
    return table_.at(row(state) + action);
  }
  void update(std::span<const double> state, std::size_t action, double target, double rate = 1.0) {
    core::require(rate > 0.0 && rate <= 1.0, "rate", "in (0, 1]", rate);
    double& q = table_.at(row(state) + action);
    q = (1.0 - rate) * q + rate * target;
  }

  friend bool operator==(const LookupTable&, const LookupTable&) = default;

 private:
  std::size_t row(std::span<const double> state) const {
    core::require(state.size() == n_inputs_, "state", "as long as n_inputs", state.size());
    std::size_t cell = 0;
    for (const double value : state) {
      core::require_in_range("state", value, 0.0, 1.0);
      const auto part = static_cast<std::size_t>(value * static_cast<double>(n_cells_));
      cell = cell * n_cells_ + std::min(part, n_cells_ - 1);
    }
    return cell * n_actions_;
  }

  std::size_t n_inputs_, n_cells_, n_actions_;
  std::vector<double> table_;
};

static_assert(approximators::ActionValue<LookupTable>);

}  // namespace sdnn::testing
