/// Number of cells of a grid, and the refusal of tables that are too large.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <ios>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/core/errors.hpp"

namespace sdnn::core {

/// The default of every max_table_bytes: 1 GiB.
inline constexpr std::uint64_t kDefaultMaxTableBytes = std::uint64_t{1} << 30;

/// Throws SizeError about the first of the `sizes`, which is n_sets in "n_sets or n_inputs".
[[noreturn]] inline void fail_for_size(std::string_view sizes, const std::ostringstream& message) {
  const std::string_view first = sizes.substr(0, sizes.find_first_of(" ,"));
  fail(SizeError(std::string(first), message.str()));
}

/// Returns a number of bytes, or the size of the address space if that is smaller.
constexpr std::uint64_t addressable(std::uint64_t n_bytes) noexcept {
  return std::min<std::uint64_t>(n_bytes, std::numeric_limits<std::size_t>::max());
}

/// Completes the message with the limit that is exceeded, and throws it as SizeError. The limit is
/// the setting max_table_bytes or, if that is high enough (`fits_table`), the address space.
[[noreturn]] inline void fail_for_limit(std::string_view sizes, std::ostringstream& message,
                                        bool fits_table, std::uint64_t max_table_bytes) {
  if (fits_table) {
    message << "at most " << addressable(max_table_bytes) << " can be addressed";
  } else {
    message << "max_table_bytes is " << max_table_bytes;
  }
  fail_for_size(sizes, message);
}

/// Begins a message: "<sizes> must be smaller: <parts> need <bytes> bytes, but ".
inline std::ostringstream message_of_bytes(std::string_view sizes, std::string_view parts,
                                           double bytes) {
  std::ostringstream message;
  message << sizes << " must be smaller: " << parts << " need " << std::fixed
          << std::setprecision(0) << bytes << " bytes, but ";
  return message;
}

/// Throws SizeError if `bytes` exceeds the setting max_table_bytes or the address space. Call it
/// before allocating; `bytes` is a double, because products of settings may exceed integers. The
/// message names the `sizes` to reduce and the `parts` that need the memory.
inline void require_table_bytes(std::string_view sizes, std::string_view parts, double bytes,
                                std::uint64_t max_table_bytes) {
  if (bytes <= static_cast<double>(addressable(max_table_bytes))) return;
  std::ostringstream message = message_of_bytes(sizes, parts, bytes);
  fail_for_limit(sizes, message, bytes <= static_cast<double>(max_table_bytes), max_table_bytes);
}

/// Throws SizeError if `bytes` exceeds the address space or `most`, which no setting changes.
inline void require_bytes(std::string_view sizes, std::string_view parts, double bytes,
                          std::uint64_t most) {
  if (bytes <= static_cast<double>(addressable(most))) return;
  std::ostringstream message = message_of_bytes(sizes, parts, bytes);
  message << "at most " << addressable(most) << " are allowed";
  fail_for_size(sizes, message);
}

/// Returns the product, or nothing if it is 2^64 or more, or a factor is missing. Requires b > 0.
constexpr std::optional<std::uint64_t> exact_product(std::optional<std::uint64_t> a,
                                                     std::uint64_t b) noexcept {
  if (!a || *a > std::numeric_limits<std::uint64_t>::max() / b) return std::nullopt;
  return *a * b;
}

/// Returns n_per_dimension ^ n_dimensions if a table with `bytes_per_cell` for each cell is
/// allowed.
///
/// A grid grows exponentially with its dimensions. Call it before allocating, so that a grid that
/// is too large causes an error instead of exhausting the memory. Requires n_per_dimension,
/// bytes_per_cell > 0. Throws SizeError naming the `sizes` to reduce ("n_sets or n_inputs"), the
/// number of `cells` ("rules"), the bytes and max_table_bytes.
inline std::size_t grid_cells(std::string_view sizes, std::string_view cells,
                              std::size_t n_per_dimension, std::size_t n_dimensions,
                              std::size_t bytes_per_cell, std::uint64_t max_table_bytes) {
  std::optional<std::uint64_t> n_cells = 1;
  for (std::size_t i = 0; i < n_dimensions && n_cells; ++i) {
    n_cells = exact_product(n_cells, n_per_dimension);
  }
  const std::optional<std::uint64_t> n_bytes = exact_product(n_cells, bytes_per_cell);
  const bool fits_table = n_bytes && *n_bytes <= max_table_bytes;
  if (fits_table && *n_bytes == addressable(*n_bytes)) return static_cast<std::size_t>(*n_cells);

  std::ostringstream message;
  message << sizes << " must be smaller: a table of " << n_per_dimension << '^' << n_dimensions;
  if (n_cells) message << " = " << *n_cells;
  message << ' ' << cells << " needs ";
  if (n_bytes) {
    message << *n_bytes << " bytes";
  } else {
    message << "2^64 bytes or more";
  }
  message << ", but ";
  fail_for_limit(sizes, message, fits_table, max_table_bytes);
}

}  // namespace sdnn::core
