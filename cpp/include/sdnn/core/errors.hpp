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

/// An error about an argument, or a field of a configuration.
template <class Error>
class NamedError : public Error {
 public:
  NamedError(std::string name, const std::string& message)
      : Error(message), name_(std::move(name)) {}

  /// Name of the argument or field; the first one where there are several.
  const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
};

/// An error about the value of an argument or a field.
using ArgumentError = NamedError<std::invalid_argument>;
/// An error about an argument or a field to reduce, which needs more memory than is allowed.
using SizeError = NamedError<std::length_error>;

#if !SDNN_EXCEPTIONS

/// A function that handles an error's message and does not return, but restarts the device, say.
using ErrorHandler = void (*)(const char* message);

/// The handler; by default it writes to standard error. If it returns, the program is aborted.
inline ErrorHandler& error_handler() noexcept {
  static ErrorHandler handler = [](const char* message) {
    std::fprintf(stderr, "sdnn: %s\n", message);
  };
  return handler;
}

#endif

/// Throws `error`. Without exceptions (-fno-exceptions), calls error_handler() and aborts.
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
