/// Parts of an agent for each dimension of its actions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// Returns the seed of a dimension: the agent's for the first, another for every other.
inline std::uint64_t seed_of_dimension(std::uint64_t seed, std::size_t d) noexcept {
  return d == 0 ? seed : core::Random(seed, core::Stream::dimensions, d).bits();
}

namespace detail {

/// The parts of an agent, one per dimension. Assigning the same number of parts keeps their
/// addresses, to which Python objects may refer.
template <class Part>
class Parts : public std::vector<Part> {
 public:
  using std::vector<Part>::vector;
  Parts(std::vector<Part> parts) noexcept : std::vector<Part>(std::move(parts)) {}
  Parts(const Parts&) = default;
  Parts(Parts&&) noexcept = default;
  Parts& operator=(const Parts& other) { return *this = Parts(other); }
  Parts& operator=(Parts&& other) {
    if (this->size() == other.size()) {
      std::ranges::move(other, this->begin());
    } else {
      std::vector<Part>::operator=(std::move(other));
    }
    return *this;
  }
  ~Parts() = default;
};

/// Returns a vector with a single part, which an initializer list would copy.
template <class Part>
std::vector<Part> only(Part part) {
  std::vector<Part> parts;
  parts.push_back(std::move(part));
  return parts;
}

}  // namespace detail
}  // namespace sdnn::agents
