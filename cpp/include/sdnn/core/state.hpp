/// The state of an object as named tensors, to be saved and restored.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/core/errors.hpp"

namespace sdnn::core {

/// The types of numbers that a tensor may hold, named as in the safetensors format.
enum class TensorType { i8, u8, i16, i32, i64, u64, f32, f64 };

/// The type of a tensor of T.
template <class T>
constexpr TensorType tensor_type() noexcept {
  if constexpr (std::is_same_v<T, double>) return TensorType::f64;
  if constexpr (std::is_same_v<T, float>) return TensorType::f32;
  if constexpr (std::is_same_v<T, std::int8_t>) return TensorType::i8;
  if constexpr (std::is_same_v<T, std::uint8_t>) return TensorType::u8;
  if constexpr (std::is_same_v<T, std::int16_t>) return TensorType::i16;
  if constexpr (std::is_same_v<T, std::int32_t>) return TensorType::i32;
  if constexpr (std::is_same_v<T, std::int64_t>) return TensorType::i64;
  if constexpr (std::is_same_v<T, std::uint64_t>) return TensorType::u64;
}

/// Facts about a type of tensors: its name in files and in NumPy, the bytes of a number, and the
/// rank by which tensors of different types are sorted in a file.
struct TensorTypeFacts {
  const char* name;
  const char* dtype;
  std::size_t n_bytes;
  int storage_rank;
};
/// The facts of each TensorType, by its number.
inline constexpr std::array<TensorTypeFacts, 8> kTensorTypes{{{"I8", "<i1", 1, 6},
                                                              {"U8", "<u1", 1, 7},
                                                              {"I16", "<i2", 2, 5},
                                                              {"I32", "<i4", 4, 4},
                                                              {"I64", "<i8", 8, 1},
                                                              {"U64", "<u8", 8, 0},
                                                              {"F32", "<f4", 4, 3},
                                                              {"F64", "<f8", 8, 2}}};

constexpr const TensorTypeFacts& facts_of(TensorType type) noexcept {
  return kTensorTypes[static_cast<std::size_t>(type)];
}

/// An array of numbers of one type, row by row, in the byte order of memory.
struct Tensor {
  TensorType type = TensorType::f64;
  std::vector<std::size_t> shape;
  std::vector<std::byte> bytes;

  /// The number of numbers.
  std::size_t size() const noexcept { return bytes.size() / facts_of(type).n_bytes; }
  bool operator==(const Tensor&) const = default;
};

/// A state: tensors by name, in the order of their names.
using State = std::map<std::string, Tensor, std::less<>>;

namespace detail {

/// Base of StateWriter and StateReader: tensors of a part have its name as a prefix, as in
/// "network.weights".
template <class Archive>
class Nested {
 public:
  /// Lists the members of a part, by its `serialize`.
  template <class Part>
  void part(std::string_view name, Part& part) {
    within(name, [&] { std::remove_const_t<Part>::serialize(part, static_cast<Archive&>(*this)); });
  }
  /// Calls `list()`, whose entries get names that begin with `name`.
  template <class List>
  void within(std::string_view name, const List& list) {
    const Prefixed prefixed(prefix, name);
    list();
  }

  std::string prefix;

 private:
  struct Prefixed {
    Prefixed(std::string& extended, std::string_view name) : prefix(extended), before(extended) {
      prefix.append(name).append(".");
    }
    Prefixed(const Prefixed&) = delete;
    Prefixed& operator=(const Prefixed&) = delete;
    ~Prefixed() { prefix = std::move(before); }

    std::string& prefix;
    std::string before;
  };
};

}  // namespace detail

/// Collects a state. A class with a state lists its members once, for writing and for reading:
///
///     template <class Self, class Archive>
///     static void serialize(Self& self, Archive& archive) {
///       archive.number("step", self.step_);
///       archive.numbers("rewards", self.rewards_);
///       archive.part("network", self.network_);
///     }
class StateWriter : public detail::Nested<StateWriter> {
 public:
  static constexpr bool kReads = false;

  /// Adds a number. Shape: ().
  template <class T>
  void number(std::string_view name, const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      number(name, static_cast<std::uint8_t>(value));
    } else {
      add<T>(name, {}, std::span<const T>(&value, 1));
    }
  }
  /// Adds a number, or no tensor if it is missing.
  template <class T>
  void number(std::string_view name, const std::optional<T>& value) {
    if (value) number(name, *value);
  }
  /// Adds a number, or no tensor if it is the `usual` one.
  template <class T>
  void number_unless(std::string_view name, const T& value, std::type_identity_t<T> usual) {
    if (value != usual) number(name, value);
  }
  /// Adds an array of any length. Shape: (n,).
  template <class T>
  void numbers(std::string_view name, const std::vector<T>& values) {
    add<T>(name, {values.size()}, values);
  }
  /// Adds an array, or no tensor if it is empty.
  template <class T>
  void some_numbers(std::string_view name, const std::vector<T>& values) {
    if (!values.empty()) numbers(name, values);
  }
  /// Adds an array of a known shape: any object with data() and size().
  template <class Values>
  void fixed(std::string_view name, std::vector<std::size_t> shape, const Values& values) {
    using T = std::remove_cvref_t<decltype(*values.data())>;
    add<T>(name, std::move(shape), {values.data(), values.size()});
  }
  /// Adds an array of a known shape, whose numbers are finite.
  template <class Values>
  void finite(std::string_view name, std::vector<std::size_t> shape, const Values& values) {
    fixed(name, std::move(shape), values);
  }

  State state;

 private:
  template <class T>
  void add(std::string_view name, std::vector<std::size_t> shape, std::span<const T> values) {
    Tensor tensor{tensor_type<T>(), std::move(shape), {}};
    const auto bytes = std::as_bytes(values);
    tensor.bytes.assign(bytes.begin(), bytes.end());
    state.insert_or_assign(prefix + std::string(name), std::move(tensor));
  }
};

/// Restores a state: each function sets what the function of the same name of StateWriter has
/// added. It throws std::invalid_argument naming a tensor that is missing or does not fit. The
/// members read so far have changed then, so read into a copy, as `restore` does.
class StateReader : public detail::Nested<StateReader> {
 public:
  static constexpr bool kReads = true;

  explicit StateReader(const State& state) : state_(state) {}

  template <class T>
  void number(std::string_view name, T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      number(name, byte);
      expect(byte <= 1, name, "0 or 1");
      value = byte == 1;
    } else {
      copy<T>(find<T>(name, {}), {&value, 1});
    }
  }
  template <class T>
  void number(std::string_view name, std::optional<T>& value) {
    value.reset();
    if (state_.contains(prefix + std::string(name))) number(name, value.emplace());
  }
  template <class T>
  void number_unless(std::string_view name, T& value, std::type_identity_t<T> usual) {
    value = usual;
    if (state_.contains(prefix + std::string(name))) number(name, value);
  }
  template <class T>
  void numbers(std::string_view name, std::vector<T>& values) {
    const Tensor& tensor = find<T>(name);
    expect(tensor.shape.size() == 1, name, "of one dimension");
    values.resize(tensor.size());
    copy<T>(tensor, values);
  }
  template <class T>
  void some_numbers(std::string_view name, std::vector<T>& values) {
    values.clear();
    if (state_.contains(prefix + std::string(name))) numbers(name, values);
  }
  template <class Values>
  void fixed(std::string_view name, const std::vector<std::size_t>& shape, Values&& values) {
    using T = std::remove_cvref_t<decltype(*values.data())>;
    copy<T>(find<T>(name, shape), {values.data(), values.size()});
  }
  template <class Values>
  void finite(std::string_view name, const std::vector<std::size_t>& shape, Values&& values) {
    fixed(name, shape, values);
    expect(std::ranges::all_of(values, [](double x) { return std::isfinite(x); }), name, "finite");
  }

  /// Counts the parts called `name`.1, `name`.2 and so on.
  std::size_t n_numbered(std::string_view name) const {
    std::size_t n = 0;
    for (;; ++n) {
      const std::string beginning = prefix + std::string(name) + "." + std::to_string(n + 1) + ".";
      const auto tensor = state_.lower_bound(beginning);
      if (tensor == state_.end() || !tensor->first.starts_with(beginning)) return n;
    }
  }

  /// Throws unless the tensor has `size` numbers. Callers compute the size from settings, before
  /// they allocate memory for these; it is a double, because the product may exceed integers.
  void expect_size(std::string_view name, double size) const {
    expect(static_cast<double>(tensor_called(name).size()) == size, name,
           "as large as the approximator's");
  }

  /// Throws "state: <prefix><name> must be <expected>" unless `holds`.
  void expect(bool holds, std::string_view name, std::string_view expected) const {
    if (holds) return;
    fail(std::invalid_argument("state: " + prefix + std::string(name) + " must be " +
                               std::string(expected)));
  }

  /// Calls `use()`, and adds the tensor's name to the message of its std::invalid_argument.
  template <class Use>
  void naming(std::string_view name, const Use& use) const {
#if SDNN_EXCEPTIONS
    try {
      use();
    } catch (const std::invalid_argument& error) {
      expect(false, name, std::string("such that ") + error.what());
    }
#else
    static_cast<void>(name);
    use();
#endif
  }

  /// Throws if the state has a tensor that was not read.
  void finish() const {
    for (const auto& [name, tensor] : state_) {
      if (read_.contains(&tensor)) continue;
      fail(std::invalid_argument("state: " + name + " must not be there"));
    }
  }

 private:
  const Tensor& tensor_called(std::string_view name) const {
    const auto item = state_.find(prefix + std::string(name));
    expect(item != state_.end(), name, "there");
    return item->second;
  }
  /// Returns a tensor of numbers of type T, whose bytes fit its shape, and notes that it was read.
  template <class T>
  const Tensor& find(std::string_view name) {
    const Tensor& tensor = tensor_called(name);
    expect(tensor.type == tensor_type<T>(), name, facts_of(tensor_type<T>()).name);
    std::size_t size = 1;
    for (const std::size_t extent : tensor.shape) {
      expect(extent == 0 || size <= tensor.bytes.size() / extent, name, "as large as its shape");
      size *= extent;
    }
    expect(size == tensor.bytes.size() / sizeof(T) && tensor.bytes.size() % sizeof(T) == 0, name,
           "as large as its shape");
    read_.insert(&tensor);
    return tensor;
  }
  template <class T>
  const Tensor& find(std::string_view name, const std::vector<std::size_t>& shape) {
    const Tensor& tensor = find<T>(name);
    if (tensor.shape != shape) {
      std::string wanted;
      for (const std::size_t extent : shape) wanted += std::to_string(extent) + ", ";
      expect(false, name, "of shape (" + wanted + ")");
    }
    return tensor;
  }
  template <class T>
  static void copy(const Tensor& tensor, std::span<T> values) noexcept {
    if (!values.empty()) std::memcpy(values.data(), tensor.bytes.data(), tensor.bytes.size());
  }

  const State& state_;
  std::set<const Tensor*> read_;  ///< all that were read
};

/// The state of an object.
template <class Object>
State state_of(const Object& object) {
  StateWriter writer;
  Object::serialize(object, writer);
  return std::move(writer.state);
}

/// Restores a state that state_of made from an object of the same configuration and seed. Throws
/// std::invalid_argument naming the tensor that does not fit; then nothing has changed.
template <class Object>
void restore(Object& object, const State& state) {
  Object restored = object;
  StateReader reader(state);
  Object::serialize(restored, reader);
  reader.finish();
  object = std::move(restored);
}

}  // namespace sdnn::core
