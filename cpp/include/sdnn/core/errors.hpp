/// Errors reach the caller as exceptions or, where there are none, through a function of his.
#pragma once

#if defined(__cpp_exceptions) || defined(_CPPUNWIND)
#define SDNN_EXCEPTIONS 1
#else
#define SDNN_EXCEPTIONS 0
#include <cstdio>
#include <cstdlib>
#endif

#include <stdexcept>
#include <string>
#include <utility>

namespace sdnn::core {

/// An argument, or a field of a configuration, is not what it must be.
class ArgumentError : public std::invalid_argument {
 public:
  ArgumentError(std::string name, const std::string& message)
      : std::invalid_argument(message), name_(std::move(name)) {}

  /// Name of the argument or field.
  const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
};

/// An argument, or a field of a configuration, needs more memory than is allowed.
class SizeError : public std::length_error {
 public:
  SizeError(std::string name, const std::string& message)
      : std::length_error(message), name_(std::move(name)) {}

  /// Name of the argument or field to reduce; the first one, if several would do.
  const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
};

#if !SDNN_EXCEPTIONS

/// Gets the message of an error, and does not return: it restarts the processor, say.
using ErrorHandler = void (*)(const char* message);

/// The handler in use. At first: it writes the message to standard error. Should a handler return,
/// the program is aborted.
inline ErrorHandler& error_handler() noexcept {
  static ErrorHandler handler = [](const char* message) {
    std::fprintf(stderr, "sdnn: %s\n", message);
  };
  return handler;
}

#endif

/// Throws `error`. Compiled without exceptions (-fno-exceptions), hands its message to
/// error_handler() and aborts.
template <class Error>
[[noreturn]] void fail(const Error& error) {
#if SDNN_EXCEPTIONS
  throw error;
#else
  error_handler()(error.what());
  std::abort();
#endif
}

}  // namespace sdnn::core
