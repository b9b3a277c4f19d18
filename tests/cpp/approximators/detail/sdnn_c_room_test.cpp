#include "sdnn/approximators/detail/sdnn_c_room.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/coding/state_code_config.hpp"

namespace sdnn::approximators {
namespace {

SDNNCConfig five_inputs() {
  return {.n_inputs = 5,
          .n_pattern_units = 16,
          .n_anchor_patterns = 3,
          .n_interpolated = 4,
          .n_symbols = {0, 7, 0, 3, 0},
          .n_hidden_units = 60,
          .n_active_units = 40};
}

// Inputs 1 and 3 of five are symbols, of 7 and 3 values; the others are numbers with 3 anchors.
TEST(Wiring, HasOneTablePerInput) {
  const SDNNCConfig config = five_inputs();
  const auto tables = code_books_of(config, 1);
  std::vector<std::size_t> sizes;
  for (const auto& table : tables) sizes.push_back(table.n_bins());
  // Numbers have (3 - 1) * (4 + 1) bins between their anchors, symbols one each.
  EXPECT_EQ(sizes, (std::vector<std::size_t>{10, 7, 10, 3, 10}));
  EXPECT_EQ(coding::n_bins_of(config), 40.0);
  // A pattern of 16 units is a word of 8 bytes, stored as it is and permuted for four partners.
  EXPECT_EQ(coding::pattern_bytes_of(config, coding::n_bins_of(config)), 40.0 * (1 + 4) * 8);
}

// An input's partners are those at certain distances (strides) in the circle of inputs.
TEST(Wiring, HasAsManyStridesAsPartners) {
  SDNNCConfig config = five_inputs();
  EXPECT_EQ(strides_of(config, 1), (std::vector<std::size_t>{1, 2, 3, 4}));
  config.max_pairs = 14;  // floor(14 / 5) = 2 of 4 partners for each of 5 inputs
  bool differ = false;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto strides = strides_of(config, seed);
    ASSERT_EQ(strides.size(), 2U);
    EXPECT_TRUE(1 <= strides[0] && strides[0] < strides[1] && strides[1] <= 4);
    differ = differ || strides != strides_of(config, 0);
  }
  EXPECT_TRUE(differ);
}

// Equal configs and seeds give equal codes, with and without given tables.
TEST(Wiring, IsThatOfANetworkOfEqualSettingsAndSeed) {
  const SDNNCConfig config = five_inputs();
  const auto wiring = wiring_of(config, code_books_of(config, 3), 3);
  const SDNNC network(config, 3);
  const std::vector<double> state = {0.1, 0.5, 0.9, 0.5, 0.3};
  const auto code_of = [&state](const coding::StateCode& code) {
    std::vector<coding::Bin> bins(state.size());
    code.bins_of(state, bins);
    std::vector<std::uint64_t> words(2 * code.n_words());
    code.encode(bins, words.data(), words.data() + code.n_words());
    return words;
  };
  EXPECT_EQ(code_of(*wiring), code_of(network.state_code()));
  EXPECT_NE(code_of(*wiring_of(config, code_books_of(config, 4), 4)), code_of(*wiring));
}

TEST(Wiring, RefusesTooManySymbolsAndMissingTables) {
  SDNNCConfig config = five_inputs();
  config.n_symbols[1] = config.n_symbols[3] = 1 << 24;  // each at its limit, too many together
  EXPECT_THROW(code_books_of(config, 1), std::length_error);
  config.n_symbols[1] = (1 << 24) + 1;
  EXPECT_THROW(code_books_of(config, 1), std::invalid_argument);
  config = five_inputs();
  auto tables = code_books_of(config, 1);
  tables.pop_back();  // four tables for five inputs
  EXPECT_THROW(wiring_of(config, tables, 1), std::invalid_argument);
}

// The fields of files are used before they are checked, so impossible fields must be accepted.
TEST(Wiring, TheSizeOfCodeBooksIsFiniteForAnyFields) {
  constexpr int kMost = 2147483647;
  for (const int n : {-kMost, -1, 0, kMost}) {
    const SDNNCConfig config{.n_inputs = n,
                             .max_pairs = n,
                             .n_pattern_units = n,
                             .n_anchor_patterns = n,
                             .n_interpolated = n,
                             .n_symbols = {n, n}};
    EXPECT_TRUE(std::isfinite(coding::pattern_bytes_of(config, coding::n_bins_of(config))));
  }
}

}  // namespace
}  // namespace sdnn::approximators
