/// Files of tensors in the safetensors format. Needs the library nlohmann/json.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <new>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "sdnn/core/detail/whole_file.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::core {

static_assert(std::endian::native == std::endian::little, "tensors are stored as they lie there");

/// What such a file holds. Source: https://huggingface.co/docs/safetensors, "Format": 8 bytes with
/// the header's length, a header in JSON, the bytes of the tensors.
struct Safetensors {
  std::map<std::string, std::string> metadata;
  State tensors;
};

/// The JSON value in `text`. Throws std::runtime_error where it is none, names a member of the
/// outermost object twice, or is larger or deeper than a header has reason to be; what is refused
/// has not been built.
inline nlohmann::json parse_json(std::string_view text) {
  constexpr int kMostLevels = 32;
  constexpr std::size_t kMostValues = 1'000'000;
  using Event = nlohmann::json::parse_event_t;
  std::size_t n_values = 0;
  std::set<std::string> keys;
  const auto check = [&](int depth, Event event, nlohmann::json& parsed) {
    if (depth > kMostLevels) throw std::runtime_error("its JSON is too deep");
    if (++n_values > kMostValues) throw std::runtime_error("its JSON has too many values");
    if (event == Event::key && depth == 1 && !keys.insert(parsed.get<std::string>()).second) {
      throw std::runtime_error("its JSON has " + parsed.dump() + " twice");
    }
    return true;
  };
  try {
    return nlohmann::json::parse(text, check);
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(std::string("its JSON is damaged: ") + error.what());
  }
}

namespace detail {

inline constexpr std::uint64_t kLongestHeader = 100'000'000;

/// Where a tensor's bytes are among those of all.
struct TensorPlace {
  TensorType type;
  std::vector<std::size_t> shape;
  std::uint64_t begin, end;
};

inline void expect_of_file(bool holds, const std::string& what) {
  if (!holds) throw std::runtime_error(what);
}

inline TensorPlace tensor_place(const std::string& name, const nlohmann::json& entry,
                                std::uint64_t n_bytes) {
  const auto expect = [&name](bool holds, const char* what) {
    if (!holds) throw std::runtime_error("tensor " + name + " " + what);
  };
  expect(entry.is_object() && entry.contains("dtype") && entry.contains("shape") &&
             entry.contains("data_offsets") && entry.size() == 3,
         "needs dtype, shape and data_offsets");
  const auto& dtype = entry["dtype"];
  const auto& shape = entry["shape"];
  const auto& offsets = entry["data_offsets"];
  constexpr std::array kTypes{TensorType::i8,  TensorType::u8,  TensorType::i16, TensorType::i32,
                              TensorType::i64, TensorType::u64, TensorType::f32, TensorType::f64};
  const auto type = std::ranges::find_if(
      kTypes, [&dtype](TensorType known) { return dtype == facts_of(known).name; });
  expect(type != kTypes.end(), "has a dtype that is not known");
  const auto is_number = [](const nlohmann::json& value) { return value.is_number_unsigned(); };
  expect(offsets.is_array() && offsets.size() == 2 && std::ranges::all_of(offsets, is_number),
         "has no data_offsets of two numbers");
  TensorPlace place{*type, {}, offsets[0].get<std::uint64_t>(), offsets[1].get<std::uint64_t>()};
  expect(place.begin <= place.end && place.end <= n_bytes, "reaches beyond the end of the file");
  expect(shape.is_array() && std::ranges::all_of(shape, is_number), "has no shape of numbers");
  const bool is_empty = std::ranges::any_of(
      shape, [](const auto& n) { return n.template get<std::uint64_t>() == 0; });
  std::uint64_t size = is_empty ? 0 : facts_of(*type).n_bytes;
  for (const auto& entry_of_shape : shape) {
    const auto extent = entry_of_shape.get<std::uint64_t>();
    expect(is_empty || size <= n_bytes / extent, "is not as large as its shape");
    if (!is_empty) size *= extent;
    place.shape.push_back(static_cast<std::size_t>(extent));
  }
  expect(size == place.end - place.begin, "is not as large as its shape");
  return place;
}

inline Safetensors read_safetensors_of(const std::filesystem::path& path) {
  std::error_code error;
  expect_of_file(std::filesystem::exists(path, error), "is not there");
  expect_of_file(std::filesystem::is_regular_file(path, error), "is no file");
  const std::uint64_t file_size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  expect_of_file(!error && file.is_open(), "cannot be read");
  const auto read = [&file](void* into, std::uint64_t n) {
    file.read(static_cast<char*>(into), static_cast<std::streamsize>(n));
    expect_of_file(static_cast<bool>(file), "cannot be read to its end");
  };

  std::uint64_t header_size = 0;
  expect_of_file(file_size >= sizeof(header_size), "is too short to be a safetensors file");
  read(&header_size, sizeof(header_size));
  expect_of_file(header_size <= kLongestHeader && header_size <= file_size - sizeof(header_size),
                 "is no safetensors file, or was cut: its header would have " +
                     std::to_string(header_size) + " bytes");
  std::string text(static_cast<std::size_t>(header_size), ' ');
  read(text.data(), header_size);
  expect_of_file(text.starts_with('{'), "is no safetensors file: its header is no JSON object");
  const nlohmann::json header = parse_json(text);
  expect_of_file(header.is_object(), "is no safetensors file: its header is no JSON object");

  const std::uint64_t n_bytes = file_size - sizeof(header_size) - header_size;
  Safetensors content;
  std::vector<std::pair<TensorPlace, std::string>> places;
  for (const auto& [name, entry] : header.items()) {
    if (name != "__metadata__") {
      places.emplace_back(tensor_place(name, entry, n_bytes), name);
      continue;
    }
    expect_of_file(entry.is_object(), "has __metadata__ that are no JSON object");
    for (const auto& [key, value] : entry.items()) {
      expect_of_file(value.is_string(), "has __metadata__ that are no text: " + key);
      content.metadata.emplace(key, value.template get<std::string>());
    }
  }
  std::ranges::sort(places, {},
                    [](const auto& item) { return std::pair(item.first.begin, item.first.end); });
  std::uint64_t reached = 0;
  for (const auto& [place, name] : places) {
    expect_of_file(place.begin == reached, "tensor " + name + " leaves a gap or overlaps another");
    reached = place.end;
  }
  expect_of_file(reached == n_bytes, "has " + std::to_string(n_bytes - reached) +
                                         " bytes after its last tensor, or lost one");
  for (auto& [place, name] : places) {
    Tensor tensor{place.type, std::move(place.shape), {}};
    tensor.bytes.resize(static_cast<std::size_t>(place.end - place.begin));
    read(tensor.bytes.data(), tensor.bytes.size());
    content.tensors.emplace(name, std::move(tensor));
  }
  return content;
}

/// The place of a type in the order in which the format's own library stores tensors.
constexpr int storage_rank(TensorType type) noexcept {
  switch (type) {
    case TensorType::u64:
      return 0;
    case TensorType::i64:
      return 1;
    case TensorType::f64:
      return 2;
    case TensorType::f32:
      return 3;
    case TensorType::i32:
      return 4;
    case TensorType::i16:
      return 5;
    case TensorType::i8:
      return 6;
    case TensorType::u8:
      break;
  }
  return 7;
}

}  // namespace detail

/// Reads a file. All sizes are checked before any memory is asked for. Throws std::runtime_error
/// naming the file and what is wrong with it.
inline Safetensors read_safetensors(const std::filesystem::path& path) {
  try {
    return detail::read_safetensors_of(path);
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(path.string() + ": does not fit into the memory");
  } catch (const std::exception& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
}

/// Writes a file, whole or not at all: the same bytes as the format's own library. Throws
/// std::runtime_error naming the file, and then what was there before stays.
inline void write_safetensors(const std::filesystem::path& path, const Safetensors& content) {
  std::vector<const State::value_type*> order;
  for (const auto& named : content.tensors) order.push_back(&named);
  std::ranges::stable_sort(order, {}, [](const State::value_type* named) {
    return detail::storage_rank(named->second.type);  // so that numbers are aligned; then by name
  });
  nlohmann::ordered_json header = nlohmann::ordered_json::object();
  if (!content.metadata.empty()) header["__metadata__"] = content.metadata;
  std::uint64_t begin = 0;
  for (const State::value_type* named : order) {
    const auto& [name, tensor] = *named;
    const std::uint64_t end = begin + tensor.bytes.size();
    header[name]["dtype"] = facts_of(tensor.type).name;
    header[name]["shape"] = tensor.shape;
    header[name]["data_offsets"] = {begin, end};
    begin = end;
  }
  std::string text;
  try {
    text = header.dump();
  } catch (const nlohmann::json::exception& error) {  // no UTF-8
    throw std::runtime_error(path.string() + ": cannot be written: " + error.what());
  }
  text.append((8 - text.size() % 8) % 8, ' ');
  const std::uint64_t header_size = text.size();
  WholeFile file(path);
  file.write(std::as_bytes(std::span(&header_size, 1)));
  file.write(std::as_bytes(std::span(text)));
  for (const State::value_type* named : order) file.write(named->second.bytes);
  file.finish();
}

}  // namespace sdnn::core
