/// The last exploring actions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/actions.hpp"

namespace sdnn::agents::detail {

/// The indices of the last exploring act in each environment. Where actions are rounded, several
/// indices give the same action, so the indices cannot be computed from it.
class TakenActions {
 public:
  explicit TakenActions(std::size_t n_dimensions) : n_dimensions_(n_dimensions) {}

  void note(std::size_t environment, const std::vector<double>& action,
            const std::vector<std::size_t>& indices) {
    if (taken_.size() <= environment) taken_.resize(environment + 1);
    taken_[environment].action = action;
    taken_[environment].indices = indices;
  }

  /// Writes the indices and returns true if `action` is that of the last exploring act.
  bool find(std::size_t environment, std::span<const double> action,
            std::vector<std::size_t>& indices) const {
    if (environment >= taken_.size() || !std::ranges::equal(taken_[environment].action, action)) {
      return false;
    }
    indices = taken_[environment].indices;
    return true;
  }

  /// Forgets the environments from this number on, as other environments may get the numbers later.
  void forget_from(std::size_t environment) {
    if (taken_.size() > environment) taken_.resize(environment);
  }

  /// Lists the members that are saved and restored; see core/state.hpp. After reading, `fits` must
  /// be called.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    std::vector<std::int64_t> environments, indices;
    for (std::size_t i = 0; i < self.taken_.size(); ++i) {
      if (self.taken_[i].indices.empty()) continue;
      environments.push_back(static_cast<std::int64_t>(i));
      for (const std::size_t index : self.taken_[i].indices) {
        indices.push_back(static_cast<std::int64_t>(index));
      }
    }
    archive.numbers("environments", environments);
    archive.numbers("indices", indices);
    if constexpr (Archive::kReads) {
      const std::size_t n = self.n_dimensions_;
      const auto is_index = [](std::int64_t i) { return std::in_range<std::size_t>(i); };
      archive.expect(
          indices.size() == environments.size() * n && std::ranges::all_of(indices, is_index),
          "indices", "of actions");
      self.taken_.clear();
      for (std::size_t k = 0; k < environments.size(); ++k) {
        const auto last = static_cast<std::int64_t>(self.taken_.size()) - 1;
        archive.expect(environments[k] > last && environments[k] < kMostEnvironments,
                       "environments", "in order");
        const auto first = indices.begin() + static_cast<std::ptrdiff_t>(k * n);
        const std::vector<std::size_t> found(first, first + static_cast<std::ptrdiff_t>(n));
        self.note(static_cast<std::size_t>(environments[k]), {}, found);
      }
    }
  }

  /// Returns whether restored indices are those of actions in at most n_environments environments,
  /// and computes their actions.
  bool fits(std::size_t n_environments, const Actions& actions) {
    if (taken_.size() > n_environments) return false;
    for (Taken& taken : taken_) {
      if (!std::ranges::equal(taken.indices, actions.n_actions(), std::ranges::less()) &&
          !taken.indices.empty()) {
        return false;
      }
      taken.action.clear();
      for (std::size_t d = 0; d < taken.indices.size(); ++d) {
        taken.action.push_back(actions.of_index(taken.indices[d], d));
      }
    }
    return true;
  }

 private:
  struct Taken {
    std::vector<double> action;
    std::vector<std::size_t> indices;
  };

  static constexpr std::int64_t kMostEnvironments = 1 << 14;

  [[maybe_unused]] std::size_t n_dimensions_;
  std::vector<Taken> taken_;
};

}  // namespace sdnn::agents::detail
