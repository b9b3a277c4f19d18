/// The random numbers of LIBSDNN, to reproduce networks that were made with it or to resume their
/// training.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/random_inverse.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/estimators/parallel_perceptron.hpp"

namespace sdnn::estimators {

/// The C++ library of a LIBSDNN build. Libraries convert random bits into integers differently.
enum class StandardLibrary {
  libstdcxx,  ///< GCC 11 and later
  msvc,       ///< Visual Studio 2012 to 2019, as in LIBSDNN's own programs
};

/// Returns the library named "libstdc++" or "msvc". Throws std::invalid_argument for other names.
inline StandardLibrary standard_library_named(std::string_view name) {
  if (name == "libstdc++") return StandardLibrary::libstdcxx;
  core::require(name == "msvc", "library", "libstdc++ or msvc", std::string(name));
  return StandardLibrary::msvc;
}

/// LIBSDNN's random numbers: std::mt19937, seeded by a std::seed_seq, which the C++ standard
/// specifies fully, and uniform integers as one standard library draws them, which it does not
/// specify.
class LibsdnnRandom {
 public:
  /// Seeds the generator. Throws std::invalid_argument if `seed` is empty.
  LibsdnnRandom(std::span<const std::uint32_t> seed, StandardLibrary library) : library_(library) {
    core::require(!seed.empty(), "seed", "at least one number", seed.size());
    std::seed_seq sequence(seed.begin(), seed.end());
    generator_.seed(sequence);
  }

  /// Draws an integer in [low, high], one of n = high - low + 1.
  ///
  /// libstdc++ multiplies 32 random bits by n and takes the high half of the product; a product
  /// whose low half is below 2^32 mod n is rejected (Lemire 2019). msvc takes the remainder of 32
  /// random bits divided by n; bits above the last whole multiple of n are rejected.
  std::int32_t uniform(std::int32_t low, std::int32_t high) {
    const auto n = static_cast<std::uint32_t>(high - low) + 1;
    const std::uint32_t incomplete = (0U - n) % n;  // 2^32 mod n
    if (library_ == StandardLibrary::libstdcxx) {
      std::uint64_t product = std::uint64_t{bits()} * n;
      while (static_cast<std::uint32_t>(product) < incomplete) product = std::uint64_t{bits()} * n;
      return low + static_cast<std::int32_t>(product >> 32);
    }
    std::uint32_t drawn = bits();
    while (incomplete != 0 && drawn >= 0U - incomplete) drawn = bits();
    return low + static_cast<std::int32_t>(drawn % n);
  }

 private:
  std::uint32_t bits() { return static_cast<std::uint32_t>(generator_()); }

  StandardLibrary library_;
  std::mt19937 generator_;
};

namespace detail {

/// Returns the column of a unit. LIBSDNN packs 32 units into a word, the first unit in the highest
/// bit, and reads words from the lowest bit. So the order is reversed within every 32 units, and
/// within the rest at the end.
inline std::size_t libsdnn_column(std::size_t unit, std::size_t n_units) noexcept {
  const std::size_t begin = unit / 32 * 32;
  const std::size_t end = begin + 32 < n_units ? begin + 32 : n_units;
  return begin + (end - 1 - unit);
}

}  // namespace detail

/// Draws a random-inverse code as LIBSDNN does. For each unit to flip, units are drawn until one
/// has the required sign and has not been flipped in the same bin; the required signs alternate, +1
/// first.
///
/// Throws std::invalid_argument where LIBSDNN would refuse the setting or not terminate.
inline coding::PatternTable libsdnn_patterns(const coding::RandomInverseConfig& config,
                                             LibsdnnRandom& random) {
  core::require_in_range("n_units", config.n_units, 2, 1 << 24);
  core::require(config.n_units % 2 == 0, "n_units", "even", config.n_units);
  core::require_in_range("n_bins", config.n_bins, 1, 1 << 24);
  core::require_in_range("n_flipped", config.n_flipped, 1, config.n_units / 2 - 1);
  const auto n_units = static_cast<std::size_t>(config.n_units);
  const auto draw = [&] { return static_cast<std::size_t>(random.uniform(0, config.n_units - 1)); };
  coding::PatternTable table(static_cast<std::size_t>(config.n_bins), n_units);
  std::vector<bool> on(n_units);
  const auto flip = [&](std::size_t bin, std::size_t unit) {
    on[unit] = !on[unit];
    table.flip(bin, detail::libsdnn_column(unit, n_units));
  };
  for (std::size_t i = 0; i < n_units / 2; ++i) {
    std::size_t unit = draw();
    while (on[unit]) unit = draw();
    flip(0, unit);
  }
  for (std::size_t bin = 1; bin < table.n_bins(); ++bin) {
    table.copy(bin - 1, bin);
    std::vector<bool> flipped(n_units);
    for (int i = 0; i < config.n_flipped; ++i) {
      for (const bool sign : {true, false}) {
        std::size_t unit = draw();
        while (flipped[unit] || on[unit] != sign) unit = draw();
        flip(bin, unit);
        flipped[unit] = true;
      }
    }
  }
  return table;
}

/// The tables of LIBSDNN's desensitization: separate ones for each pair of inputs and role.
struct LibsdnnTables {
  std::vector<coding::PatternTable> modified;
  std::vector<coding::PatternTable> modifiers;
};

/// Draws the tables in LIBSDNN's order: for each pair that of the modifier, then that of the
/// modified input. `inputs` has a configuration for each input. Throws std::invalid_argument for a
/// pair of an unknown input, or where LIBSDNN would refuse a setting or not terminate.
inline LibsdnnTables libsdnn_tables(std::span<const coding::RandomInverseConfig> inputs,
                                    std::span<const coding::InputPair> pairs,
                                    LibsdnnRandom& random) {
  LibsdnnTables tables;
  for (const coding::InputPair& pair : pairs) {
    core::require(pair.modified < inputs.size() && pair.modifier < inputs.size(), "pairs",
                  "inputs below " + std::to_string(inputs.size()),
                  std::max(pair.modified, pair.modifier));
    tables.modifiers.push_back(libsdnn_patterns(inputs[pair.modifier], random));
    tables.modified.push_back(libsdnn_patterns(inputs[pair.modified], random));
  }
  return tables;
}

/// The initial weights and thresholds of a LIBSDNN network.
struct LibsdnnWeights {
  std::vector<std::int32_t> weights;     ///< (n_units, n_columns)
  std::vector<std::int32_t> thresholds;  ///< (n_units,)
};

/// Draws weights and thresholds, uniformly in [low, high], in LIBSDNN's order: for each unit the
/// threshold, then the weights. Throws
/// std::invalid_argument unless low <= high and both are in [-10^6, 10^6].
inline LibsdnnWeights libsdnn_weights(std::size_t n_units, std::size_t n_columns, int low, int high,
                                      LibsdnnRandom& random) {
  core::require_in_range("low", low, -1000000, 1000000);
  core::require_in_range("high", high, low, 1000000);
  core::require_bytes("n_units or n_columns", "the weights",
                      4.0 * static_cast<double>(n_units) * static_cast<double>(n_columns),
                      kMaxWeightBytes);
  LibsdnnWeights drawn;
  drawn.weights.reserve(n_units * n_columns);
  drawn.thresholds.reserve(n_units);
  for (std::size_t i = 0; i < n_units; ++i) {
    core::interruption_point();
    drawn.thresholds.push_back(random.uniform(low, high));
    for (std::size_t j = 0; j < n_columns; ++j) drawn.weights.push_back(random.uniform(low, high));
  }
  return drawn;
}

}  // namespace sdnn::estimators
