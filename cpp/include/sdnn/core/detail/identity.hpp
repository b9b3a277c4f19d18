/// Objects that others recognize, whatever their address.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

namespace sdnn::core {

/// A number that no other object of the process has. A copy gets a number of its own; a move takes
/// the number along.
class Identity {
 public:
  Identity() noexcept = default;
  Identity(const Identity&) noexcept {}
  Identity(Identity&& other) noexcept : number_(std::exchange(other.number_, next())) {}
  Identity& operator=(const Identity& other) noexcept {
    if (this != &other) number_ = next();
    return *this;
  }
  Identity& operator=(Identity&& other) noexcept {
    if (this != &other) number_ = std::exchange(other.number_, next());
    return *this;
  }
  ~Identity() = default;

  /// Never 0.
  std::uint64_t number() const noexcept { return number_; }

 private:
  static std::uint64_t next() noexcept {
    static std::atomic<std::uint64_t> last{0};
    return last.fetch_add(1, std::memory_order_relaxed) + 1;
  }

  std::uint64_t number_ = next();
};

}  // namespace sdnn::core
