/// The file format of agents, trainings and estimators, which Python reads and writes too (see
/// python/sdnn/support/files.py). Needs the library nlohmann/json.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdnn/core/detail/crc32.hpp"
#include "sdnn/core/detail/whole_file.hpp"
#include "sdnn/core/state.hpp"
#include "sdnn/core/version.hpp"

namespace sdnn::core {

static_assert(std::endian::native == std::endian::little,
              "tensors are stored with the lowest byte first");

/// Content of a file.
struct FileContent {
  std::string kind;                                       ///< "agent", "training" or "estimator"
  nlohmann::json description = nlohmann::json::object();  ///< all but the tensors
  State tensors;
};

/// The number of the only supported format.
inline constexpr int kFileFormat = 1;

/// Parses JSON. Throws std::runtime_error, before a value is built, for a text that is not JSON,
/// has a member of the outermost object twice, or exceeds the size or depth of headers.
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

/// Limits of files, in bytes. That of headers is the one of the safetensors library; that of files,
/// 16 GiB or half the address space, is a chosen constant.
inline constexpr std::uint64_t kLongestHeader = 100'000'000;
inline constexpr std::uint64_t kLargestFile =
    std::min<std::uint64_t>(std::uint64_t{1} << 34, std::numeric_limits<std::ptrdiff_t>::max());

/// Tensors that a file may have in addition to one for every two bytes of data (chosen). More would
/// be empty tensors of a damaged header, whose parsing takes memory.
inline constexpr std::uint64_t kMostEmptyTensors = 1024;

/// Counts how often a word occurs in a text.
inline std::size_t count_of(std::string_view text, std::string_view word) {
  std::size_t n = 0;
  for (auto at = text.find(word); at != text.npos; at = text.find(word, at + word.size())) ++n;
  return n;
}

/// Place of a tensor's bytes among all bytes.
struct TensorPlace {
  TensorType type;
  std::vector<std::size_t> shape;
  std::uint64_t begin, end;
};

/// Throws std::runtime_error with the `problem` unless `holds`.
inline void expect_of_file(bool holds, const std::string& problem) {
  if (!holds) throw std::runtime_error(problem);
}

/// Reads type, shape and bytes of a tensor from its entry, maybe damaged, in the header of a file
/// with `n_bytes` of tensors. Throws std::runtime_error naming tensor and problem.
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
  const auto facts = std::ranges::find_if(
      kTensorTypes, [&dtype](const TensorTypeFacts& known) { return dtype == known.name; });
  expect(facts != kTensorTypes.end(), "has a dtype that is not known");
  const auto type = static_cast<TensorType>(facts - kTensorTypes.begin());
  const auto is_number = [](const nlohmann::json& value) { return value.is_number_unsigned(); };
  expect(offsets.is_array() && offsets.size() == 2 && std::ranges::all_of(offsets, is_number),
         "has no data_offsets of two numbers");
  TensorPlace place{type, {}, offsets[0].get<std::uint64_t>(), offsets[1].get<std::uint64_t>()};
  expect(place.begin <= place.end && place.end <= n_bytes, "reaches beyond the end of the file");
  expect(shape.is_array() && std::ranges::all_of(shape, is_number), "has no shape of numbers");
  const bool is_empty = std::ranges::any_of(
      shape, [](const auto& n) { return n.template get<std::uint64_t>() == 0; });
  std::uint64_t size = is_empty ? 0 : facts->n_bytes;
  for (const auto& number : shape) {
    const auto extent = number.get<std::uint64_t>();
    expect(is_empty || size <= n_bytes / extent, "is not as large as its shape");
    expect(std::in_range<std::size_t>(extent), "has a shape beyond the address space");
    if (!is_empty) size *= extent;
    place.shape.push_back(static_cast<std::size_t>(extent));
  }
  expect(size == place.end - place.begin, "is not as large as its shape");
  return place;
}

/// Throws std::runtime_error unless tensors, in order, fill the `n_bytes` without gap or overlap.
inline void expect_contiguous(const std::vector<std::pair<TensorPlace, std::string>>& places,
                              std::uint64_t n_bytes) {
  std::uint64_t reached = 0;
  for (const auto& [place, name] : places) {
    expect_of_file(place.begin == reached, "tensor " + name + " leaves a gap or overlaps another");
    reached = place.end;
  }
  expect_of_file(reached == n_bytes, "has " + std::to_string(n_bytes - reached) +
                                         " bytes after its last tensor, or lost one");
}

/// The content of a safetensors file.
struct Safetensors {
  std::string about;  ///< the text of "sdnn" in the metadata
  State tensors;
};

/// Parses a file of `size` bytes, of which `read(begin, into)` reads a part: 8 bytes with the
/// length of the header, the header in JSON, the bytes of all tensors. All sizes are checked before
/// any allocation. Source: https://huggingface.co/docs/safetensors, "Format".
template <class Read>
Safetensors parse_safetensors(std::uint64_t size, const Read& read) {
  std::uint64_t header_size = 0;
  expect_of_file(size >= sizeof(header_size), "is too short to be a safetensors file");
  read(0, std::as_writable_bytes(std::span(&header_size, 1)));
  const std::uint64_t n_left = size - sizeof(header_size);
  expect_of_file(header_size <= kLongestHeader && header_size <= n_left,
                 "is no safetensors file, or was cut: its header would have " +
                     std::to_string(header_size) + " bytes");
  std::string text(static_cast<std::size_t>(header_size), ' ');
  read(sizeof(header_size), std::as_writable_bytes(std::span(text)));
  expect_of_file(text.starts_with('{'), "is no safetensors file: its header is no JSON object");
  const std::uint64_t n_bytes = n_left - header_size;
  const std::size_t n_tensors = count_of(text, "\"dtype\"");
  expect_of_file(
      n_tensors <= kMostEmptyTensors + n_bytes / 2,
      "has " + std::to_string(n_tensors) + " tensors in so many bytes: " + std::to_string(n_bytes));
  const nlohmann::json header = parse_json(text);
  Safetensors content;
  std::vector<std::pair<TensorPlace, std::string>> places;
  for (const auto& [name, entry] : header.items()) {
    if (name != "__metadata__") {
      places.emplace_back(tensor_place(name, entry, n_bytes), name);
      continue;
    }
    expect_of_file(entry.is_object() && entry.contains("sdnn") && entry["sdnn"].is_string(),
                   "has no text \"sdnn\" in its __metadata__");
    content.about = entry["sdnn"].template get<std::string>();
  }
  std::ranges::sort(places, {},
                    [](const auto& item) { return std::pair(item.first.begin, item.first.end); });
  expect_contiguous(places, n_bytes);
  for (auto& [place, name] : places) {
    Tensor tensor{place.type, std::move(place.shape), {}};
    tensor.bytes.resize(static_cast<std::size_t>(place.end - place.begin));
    read(size - n_bytes + place.begin, std::span(tensor.bytes));
    content.tensors.emplace(name, std::move(tensor));
  }
  return content;
}

/// The beginning of the header of every file of sdnn; the 8 hexadecimal digits of the checksum
/// follow, so that they are at the same place in all files.
inline constexpr std::string_view kBeginning = R"({"__metadata__":{"sdnn":"{\"checksum\":\")";
inline constexpr std::size_t kChecksumBegin = sizeof(std::uint64_t) + kBeginning.size();
inline constexpr std::size_t kChecksumEnd = kChecksumBegin + 8;

inline std::string digits_of(std::uint32_t crc) {
  std::string digits;
  for (int shift = 28; shift >= 0; shift -= 4) digits += "0123456789abcdef"[(crc >> shift) & 15U];
  return digits;
}

/// Returns the header of a file whose tensors are written in this order, with a checksum of zeros.
/// Throws nlohmann::json::exception if a text is not UTF-8.
inline std::string header_of(const FileContent& content,
                             const std::vector<const State::value_type*>& order) {
  const nlohmann::json about = {{"checksum", "00000000"},
                                {"description", content.description},
                                {"format", kFileFormat},
                                {"kind", content.kind},
                                {"version", kVersion}};
  nlohmann::ordered_json header;
  header["__metadata__"]["sdnn"] = about.dump(-1, ' ', true);
  std::uint64_t begin = 0;
  for (const State::value_type* named : order) {
    const auto& [name, tensor] = *named;
    const std::uint64_t end = begin + tensor.bytes.size();
    header[name]["dtype"] = facts_of(tensor.type).name;
    header[name]["shape"] = tensor.shape;
    header[name]["data_offsets"] = {begin, end};
    begin = end;
  }
  return header.dump();
}

/// Returns the checksum of all bytes of a file except the digits of its checksum.
template <class Read>
std::string checksum_of(std::uint64_t size, const Read& read) {
  std::vector<std::byte> buffer(std::size_t{1} << 16);
  std::uint32_t crc = 0;
  const auto add = [&](std::uint64_t begin, std::uint64_t end) {
    while (begin < end) {
      const auto bytes = std::span(buffer).first(
          static_cast<std::size_t>(std::min<std::uint64_t>(buffer.size(), end - begin)));
      read(begin, bytes);
      crc = crc32(bytes, crc);
      begin += bytes.size();
    }
  };
  add(0, kChecksumBegin);
  add(kChecksumEnd, size);
  return digits_of(crc);
}

/// Compares the checksum of a file, then parses it. Throws std::runtime_error naming the problem.
inline Safetensors read_checked(const std::filesystem::path& path) {
  RegularFile file(path);
  const auto read = [&file](std::uint64_t begin, std::span<std::byte> into) {
    file.read(begin, into);
  };
  expect_of_file(file.size() <= kLargestFile,
                 "has more than " + std::to_string(kLargestFile) + " bytes");
  std::string beginning(file.size() < kChecksumEnd ? 0 : kChecksumEnd, ' ');
  read(0, std::as_writable_bytes(std::span(beginning)));
  expect_of_file(
      !beginning.empty() && std::string_view(beginning).substr(8).starts_with(kBeginning),
      "is not a file of sdnn, is damaged, or was written before files of sdnn had a "
      "checksum");
  expect_of_file(beginning.substr(kChecksumBegin) == checksum_of(file.size(), read),
                 "is damaged: its checksum does not fit its content");
  return parse_safetensors(file.size(), read);
}

}  // namespace detail

/// Reads a file of one of the `kinds`. Throws std::runtime_error naming the file and the problem.
inline FileContent read_file(const std::filesystem::path& path,
                             std::initializer_list<std::string_view> kinds) {
  try {
    detail::Safetensors parsed = detail::read_checked(path);
    nlohmann::json about = parse_json(parsed.about);
    const auto text_of = [&about](const char* key) { return about.value(key, std::string()); };
    const auto number = about.value("format", nlohmann::json());
    detail::expect_of_file(number == kFileFormat,
                           "has format " + number.dump() + ", written by sdnn " +
                               text_of("version") + "; this is sdnn " + kVersion +
                               ", which reads format " + std::to_string(kFileFormat));
    FileContent content{text_of("kind"), about["description"], std::move(parsed.tensors)};
    std::string expected;
    for (const auto kind : kinds) expected.append(expected.empty() ? "" : " or ").append(kind);
    detail::expect_of_file(std::ranges::find(kinds, content.kind) != kinds.end(),
                           "is a file of kind '" + content.kind + "', expected " + expected);
    detail::expect_of_file(content.description.is_object(), "is damaged: it has no description");
    return content;
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(path.string() + ": does not fit into the memory");
  } catch (const std::exception& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
}

/// Writes a file whole or not at all, with the same bytes as in Python, except for rare numbers
/// with several shortest texts. Throws std::runtime_error naming the file; an earlier one stays.
inline void write_file(const std::filesystem::path& path, const FileContent& content) {
  std::vector<const State::value_type*> order;
  for (const auto& named : content.tensors) order.push_back(&named);
  std::ranges::stable_sort(order, {}, [](const State::value_type* named) {
    return facts_of(named->second.type).storage_rank;  // aligns numbers; ties are ordered by name
  });
  std::string text;
  try {
    text = detail::header_of(content, order);
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(path.string() + ": cannot be written: " + error.what());
  }
  text.append((8 - text.size() % 8) % 8, ' ');  // so that tensors begin at multiples of 8 bytes
  const std::uint64_t header_size = text.size();
  text.insert(0, reinterpret_cast<const char*>(&header_size), sizeof(header_size));
  const auto head = std::as_bytes(std::span(text));
  std::uint32_t crc = detail::crc32(head.first(detail::kChecksumBegin));
  crc = detail::crc32(head.subspan(detail::kChecksumEnd), crc);
  for (const State::value_type* named : order) crc = detail::crc32(named->second.bytes, crc);
  text.replace(detail::kChecksumBegin, 8, detail::digits_of(crc));
  WholeFile file(path);
  file.write(std::as_bytes(std::span(text)));
  for (const State::value_type* named : order) file.write(named->second.bytes);
  file.finish();
}

}  // namespace sdnn::core
