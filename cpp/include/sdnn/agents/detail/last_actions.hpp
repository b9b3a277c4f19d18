/// The last exploring action in each environment.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/actions.hpp"
#include "sdnn/agents/episodes.hpp"

namespace sdnn::agents::detail {

/// The action of the last exploring act in each environment, and its indices. Where actions are
/// rounded, several indices give the same action, so the indices cannot be computed from it.
class LastActions {
 public:
  explicit LastActions(std::size_t n_dimensions) : n_dimensions_(n_dimensions) {}

  void note(std::size_t environment, const std::vector<double>& action,
            const std::vector<std::size_t>& indices) {
    if (last_.size() <= environment) last_.resize(environment + 1);
    last_[environment].action = action;
    last_[environment].indices = indices;
  }

  /// Writes the indices and returns true if `action` is that of the last exploring act.
  bool find(std::size_t environment, std::span<const double> action,
            std::vector<std::size_t>& indices) const {
    if (environment >= last_.size() || !std::ranges::equal(last_[environment].action, action)) {
      return false;
    }
    indices = last_[environment].indices;
    return true;
  }

  /// Forgets the environments from this number on, as other environments may get the numbers later.
  void forget_from(std::size_t environment) {
    if (last_.size() > environment) last_.resize(environment);
  }

  /// Lists the saved members; see core/state.hpp. After reading, `fits` must be called.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    std::vector<std::int64_t> environments, indices;
    for (std::size_t i = 0; i < self.last_.size(); ++i) {
      if (self.last_[i].indices.empty()) continue;
      environments.push_back(static_cast<std::int64_t>(i));
      for (const std::size_t index : self.last_[i].indices) {
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
      self.last_.clear();
      for (std::size_t k = 0; k < environments.size(); ++k) {
        const auto least = static_cast<std::int64_t>(self.last_.size());  // above the one before
        archive.expect(environments[k] >= least &&
                           environments[k] < static_cast<std::int64_t>(kMostEnvironments),
                       "environments", "in order");
        const auto first = indices.begin() + static_cast<std::ptrdiff_t>(k * n);
        self.note(static_cast<std::size_t>(environments[k]), {},
                  {first, first + static_cast<std::ptrdiff_t>(n)});
      }
    }
  }

  /// Computes the actions of restored indices. Returns whether these and the environments exist.
  bool fits(std::size_t n_environments, const Actions& actions) {
    if (last_.size() > n_environments) return false;
    for (LastAction& last : last_) {
      // Each index must be less than the number of actions of its dimension.
      if (!std::ranges::equal(last.indices, actions.n_actions(), std::ranges::less()) &&
          !last.indices.empty()) {
        return false;
      }
      last.action.clear();
      for (std::size_t d = 0; d < last.indices.size(); ++d) {
        last.action.push_back(actions.of_index(last.indices[d], d));
      }
    }
    return true;
  }

 private:
  /// An action in the units of the task, and its indices. Empty before the first exploring act.
  struct LastAction {
    std::vector<double> action;
    std::vector<std::size_t> indices;
  };

  [[maybe_unused]] std::size_t n_dimensions_;
  std::vector<LastAction> last_;  ///< of each environment
};

}  // namespace sdnn::agents::detail
