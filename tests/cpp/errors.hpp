/// Messages of errors.
#pragma once

#include <stdexcept>
#include <string>

namespace sdnn::testing {

/// The message of the error that `call` throws, or "no error".
template <class Error = std::invalid_argument, class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace sdnn::testing
