/// Numbers that identify objects independently of their addresses.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

namespace sdnn::core {

/// A number that no other object of the process has. A copy gets a new number; a move transfers it.
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

  /// The number, which is never 0.
  std::uint64_t number() const noexcept { return number_; }

 private:
  static std::uint64_t next() noexcept {
    static std::atomic<std::uint64_t> last{0};
    return last.fetch_add(1, std::memory_order_relaxed) + 1;
  }

  std::uint64_t number_ = next();
};

}  // namespace sdnn::core
