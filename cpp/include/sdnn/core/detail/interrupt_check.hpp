/// How long work asks whether it should end.
#pragma once

#include <functional>
#include <utility>

namespace sdnn::core {

/// Called now and then by long work, in the thread that asked for it and between its pieces; what
/// it throws ends the work. By default it does nothing.
class InterruptCheck {
 public:
  InterruptCheck() = default;
  explicit InterruptCheck(std::function<void()> check) : check_(std::move(check)) {}

  void operator()() const {
    if (check_) check_();
  }

 private:
  std::function<void()> check_;
};

}  // namespace sdnn::core
