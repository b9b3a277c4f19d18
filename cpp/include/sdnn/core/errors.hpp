/// Errors: exceptions or, in builds without exceptions, calls of a handler.
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

/// An error about the value of an argument or a field of a configuration.
class ArgumentError : public std::invalid_argument {
 public:
  ArgumentError(std::string name, const std::string& message)
      : std::invalid_argument(message), name_(std::move(name)) {}

  /// Name of the argument or field.
  const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
};

/// An error about an argument or a field that needs more memory than is allowed.
class SizeError : public std::length_error {
 public:
  SizeError(std::string name, const std::string& message)
      : std::length_error(message), name_(std::move(name)) {}

  /// Name of the argument or field to reduce, or of the first of several.
  const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
};

#if !SDNN_EXCEPTIONS

/// A function that handles the message of an error and does not return; it may restart the
/// processor.
using ErrorHandler = void (*)(const char* message);

/// The current handler; the default writes the message to standard error. The program is aborted if
/// a handler returns.
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
