/// Parts of all targets: values made of an input's bytes, and errors that a caller may get.
#pragma once

#include <fuzzer/FuzzedDataProvider.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace sdnn::fuzz {

/// Ends the run with a message if the condition does not hold; libFuzzer then keeps the input.
inline void expect(bool holds, const char* violation) {
  if (holds) return;
  std::fprintf(stderr, "wrong: %s\n", violation);
  std::abort();
}

/// Does a call; returns false if it is refused by an error, which must have a message.
template <class Call>
bool accepted(const Call& call) {
  try {
    call();
    return true;
  } catch (const std::exception& error) {
    expect(std::strlen(error.what()) > 0, "an error has no message");
    return false;
  }
}

/// Returns half of the time a double in [low, high], else one with any bits, NaN included.
inline double any_double(FuzzedDataProvider& input, double low, double high) {
  if (input.ConsumeBool()) return input.ConsumeFloatingPointInRange(low, high);
  return std::bit_cast<double>(input.ConsumeIntegral<std::uint64_t>());
}

/// Returns n doubles: in an eighth of the calls as of `any_double`, else all in [low, high].
inline std::vector<double> any_doubles(FuzzedDataProvider& input, std::size_t n, double low,
                                       double high) {
  std::vector<double> values(n);
  const bool wild = input.ConsumeIntegralInRange(0, 7) == 0;
  for (double& value : values) {
    value = wild ? any_double(input, low, high) : input.ConsumeFloatingPointInRange(low, high);
  }
  return values;
}

/// Sets a field of a configuration to a value that may be invalid.
template <class Value>
void set_any(Value& value, FuzzedDataProvider& input) {
  if constexpr (std::is_same_v<Value, bool>) {
    value = input.ConsumeBool();
  } else if constexpr (std::is_floating_point_v<Value>) {
    value = any_double(input, -10.0, 10.0);
  } else if constexpr (std::is_enum_v<Value>) {
    value = static_cast<Value>(input.ConsumeIntegralInRange(0, 1));
  } else if constexpr (std::is_integral_v<Value>) {
    value = input.ConsumeBool() ? input.ConsumeIntegral<Value>()
                                : static_cast<Value>(input.ConsumeIntegralInRange(-2, 40));
  } else if constexpr (std::is_same_v<Value, std::vector<bool>>) {
    value.assign(input.ConsumeIntegralInRange<std::size_t>(0, 6), input.ConsumeBool());
  } else if constexpr (std::is_same_v<Value, std::vector<int>>) {
    value.assign(input.ConsumeIntegralInRange<std::size_t>(0, 6), 0);
    for (int& number : value) set_any(number, input);
  } else {  // optional
    value.reset();
    if (input.ConsumeBool()) set_any(value.emplace(), input);
  }
}

/// Sets up to four fields of a configuration to any values.
template <class Config>
void change(Config& config, FuzzedDataProvider& input) {
  constexpr auto kFields = Config::fields();
  constexpr std::size_t kSize = std::tuple_size_v<decltype(kFields)>;
  for (int n = input.ConsumeIntegralInRange(0, 4); n > 0; --n) {
    const auto chosen = input.ConsumeIntegralInRange<std::size_t>(0, kSize - 1);
    [&]<std::size_t... Index>(std::index_sequence<Index...>) {
      ((Index == chosen ? set_any(std::get<Index>(kFields).of(config), input) : void()), ...);
    }(std::make_index_sequence<kSize>());
  }
}

/// Returns a function that reads from these bytes as readers of files do.
inline auto reader_of(std::span<const std::uint8_t> file) {
  return [file](std::uint64_t begin, std::span<std::byte> into) {
    const auto part = std::as_bytes(file).subspan(static_cast<std::size_t>(begin), into.size());
    std::ranges::copy(part, into.begin());
  };
}

/// A file in memory with these bytes.
class MemoryFile {
 public:
  explicit MemoryFile(std::span<const std::uint8_t> bytes) : file_(::memfd_create("input", 0)) {
    expect(file_ >= 0 &&
               ::write(file_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
           "no file in memory");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(file_); }

  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

}  // namespace sdnn::fuzz
