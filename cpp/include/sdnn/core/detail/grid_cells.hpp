/// Number of cells of a grid, and the refusal of tables that are too large.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <ios>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>

#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/core/errors.hpp"

namespace sdnn::core {

/// The default of every max_table_bytes: 1 GiB.
inline constexpr std::uint64_t kDefaultMaxTableBytes = std::uint64_t{1} << 30;

/// Throws SizeError "<sizes> must be smaller: ..."; `sizes` are names: "n_sets or n_inputs".
[[noreturn]] inline void fail_for_size(std::string_view sizes, const std::ostringstream& message) {
  const std::string_view first = sizes.substr(0, sizes.find_first_of(" ,"));
  fail(SizeError(std::string(first), message.str()));
}

/// A limit in bytes, at most the address space.
constexpr std::uint64_t addressable(std::uint64_t most) noexcept {
  constexpr std::uint64_t kAddressable = std::numeric_limits<std::size_t>::max();
  return most < kAddressable ? most : kAddressable;
}

/// Ends the message with the limit that is exceeded: the address space if `fits_table`.
[[noreturn]] inline void fail_for_limit(std::string_view sizes, std::ostringstream& message,
                                        bool fits_table, std::uint64_t max_table_bytes) {
  if (fits_table) {
    message << "at most " << addressable(max_table_bytes) << " can be addressed";
  } else {
    message << "max_table_bytes is " << max_table_bytes;
  }
  fail_for_size(sizes, message);
}

/// Throws SizeError "<sizes> must be smaller: <what> need <bytes> bytes, but max_table_bytes is
/// ..." for too many bytes. Call it before allocating; `bytes` is a double, which no product
/// overflows.
inline void require_table_bytes(std::string_view sizes, std::string_view what, double bytes,
                                std::uint64_t max_table_bytes) {
  if (bytes <= static_cast<double>(addressable(max_table_bytes))) return;
  std::ostringstream message;
  message << sizes << " must be smaller: " << what << " need " << std::fixed << std::setprecision(0)
          << bytes << " bytes, but ";
  fail_for_limit(sizes, message, bytes <= static_cast<double>(max_table_bytes), max_table_bytes);
}

/// Checks a limit that no setting changes: "... bytes, but at most <most> are allowed".
inline void require_bytes(std::string_view sizes, std::string_view what, double bytes,
                          std::uint64_t most) {
  if (bytes <= static_cast<double>(addressable(most))) return;
  std::ostringstream message;
  message << sizes << " must be smaller: " << what << " need " << std::fixed << std::setprecision(0)
          << bytes << " bytes, but at most " << addressable(most) << " are allowed";
  fail_for_size(sizes, message);
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
  constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t n = 1;
  bool countable = true;
  for (std::size_t i = 0; i < n_dimensions && countable; ++i) {
    countable = n <= kMost / n_per_dimension;
    if (countable) n *= n_per_dimension;
  }
  const bool sized = countable && n <= kMost / bytes_per_cell;
  const bool fits_table = sized && n * bytes_per_cell <= max_table_bytes;
  if (fits_table && n * bytes_per_cell == addressable(n * bytes_per_cell)) {
    return static_cast<std::size_t>(n);
  }

  std::ostringstream message;
  message << sizes << " must be smaller: a table of " << n_per_dimension << '^' << n_dimensions;
  if (countable) message << " = " << n;
  message << ' ' << cells << " needs ";
  if (sized) {
    message << n * bytes_per_cell << " bytes";
  } else {
    message << "2^64 bytes or more";
  }
  message << ", but ";
  fail_for_limit(sizes, message, fits_table, max_table_bytes);
}

}  // namespace sdnn::core
