#include "sdnn/coding/state_code.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/coding/anchor_patterns.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {
namespace {

StateCode small_code(std::size_t l, int m, std::uint64_t seed,
                     std::vector<std::size_t> strides = {}) {
  std::vector<PatternTable> tables;
  std::vector<Permutation> permutations;
  for (std::size_t mu = 0; mu < l; ++mu) {
    core::Random random(seed, core::Stream::code_books, mu);
    tables.push_back(anchor_patterns({.n_units = m}, random));
  }
  for (std::size_t g = 0; g < l * (strides.empty() ? l - 1 : strides.size()); ++g) {
    core::Random random(seed, core::Stream::permutations, g);
    permutations.push_back(random_permutation(static_cast<std::size_t>(m), random));
  }
  return {std::move(tables), std::move(permutations), std::move(strides)};
}

/// The paired code of a state as words.
struct Paired {
  Paired(const StateCode& code, std::span<const Bin> bins)
      : words(2 * code.n_words()), n_words(code.n_words()), lists(code.column_lists()) {
    code.encode(bins, words.data(), words.data() + n_words);
    lists.read(view());
  }
  TernaryCode view() const { return {words.data(), words.data() + n_words}; }

  std::vector<std::uint64_t> words;
  std::size_t n_words;
  ColumnLists lists;
};

/// The sum of the listed columns, as a dense vector.
std::vector<int> dense(std::size_t n_columns, const SignedColumns& columns) {
  std::vector<int> x(n_columns, 0);
  for (const auto j : columns.plus) x[j] += 1;
  for (const auto j : columns.minus) x[j] -= 1;
  return x;
}

std::vector<int> paired(const StateCode& code, std::span<const Bin> bins) {
  return dense(code.n_columns(), Paired(code, bins).lists.columns());
}

/// x_SD in the paper's order, from the paired code.
std::vector<int> x_sd(const StateCode& code, std::span<const Bin> bins) {
  const std::vector<int> stored = paired(code, bins);
  std::vector<int> x(code.n_columns());
  for (std::size_t j = 0; j < x.size(); ++j) {
    const auto columns = code.columns_of(j);
    x[j] = stored[columns.first] + (columns.paired ? columns.sign * stored[columns.second] : 0);
  }
  return x;
}

/// The number of inputs l, and the strides; without strides all pairs.
struct Wiring {
  std::size_t l;
  std::vector<std::size_t> strides = {};

  StateCode code(int m, std::uint64_t seed) const { return small_code(l, m, seed, strides); }
  std::size_t n_partners() const { return strides.empty() ? l - 1 : strides.size(); }
  bool has_pair(std::size_t mu, std::size_t nu) const {  ///< whether input nu modifies input mu
    if (strides.empty()) return mu != nu;
    return std::ranges::find(strides, (nu + l - mu) % l) != strides.end();
  }
};

// Numbers of inputs and of partners that leave unpaired columns, and others that leave none.
class StateCodeOfInputs : public ::testing::TestWithParam<Wiring> {};
INSTANTIATE_TEST_SUITE_P(Inputs, StateCodeOfInputs,
                         ::testing::Values(Wiring{2}, Wiring{3}, Wiring{4}, Wiring{5}, Wiring{6},
                                           Wiring{6, {4}}, Wiring{5, {2, 3}}, Wiring{6, {1, 3, 4}},
                                           Wiring{4, {1, 2, 3}}, Wiring{6, {1, 2, 4, 5}}));

// A column is unit k of x_mu where unit sigma(k) of x_nu is +1, and 0 where it is -1.
TEST_P(StateCodeOfInputs, EqualsTheEquationOfLayer3) {
  const Wiring wiring = GetParam();
  const std::size_t l = wiring.l;
  const auto code = wiring.code(37, 5);
  EXPECT_EQ(code.n_columns(), 37U * l * wiring.n_partners());
  std::vector<InputPair> groups;
  std::vector<Bin> bins = {17, 200, 359, 0, 90, 123};
  bins.resize(l);
  const auto x = x_sd(code, bins);
  std::size_t j = 0;
  for (std::size_t mu = 0; mu < l; ++mu) {
    for (std::size_t nu = 0; nu < l; ++nu) {
      if (!wiring.has_pair(mu, nu)) {
        EXPECT_THROW(static_cast<void>(code.permutation(mu, nu)), std::invalid_argument);
        continue;
      }
      groups.push_back({.modified = mu, .modifier = nu});
      const auto& sigma = code.permutation(mu, nu);
      for (std::size_t k = 0; k < 37; ++k, ++j) {
        const int x_mu = code.table(mu)[static_cast<std::size_t>(bins[mu])][k] ? 1 : -1;
        const int modifier = code.table(nu)[static_cast<std::size_t>(bins[nu])][sigma[k]] ? 1 : -1;
        EXPECT_EQ(x[j], (1 + modifier) / 2 * x_mu);
      }
    }
  }
  EXPECT_TRUE(std::ranges::equal(code.groups(), groups));
}

// A pair of columns is stored as half its sum and half its difference. Where both are active, one
// of the two is 0.
TEST_P(StateCodeOfInputs, ThePairedCodeHasHalfAsManyActiveColumns) {
  const std::size_t l = GetParam().l, k = GetParam().n_partners();
  const auto code = GetParam().code(37, 5);
  EXPECT_EQ(code.n_double_columns(), 37U * l * (k - k % 2));  // an odd partner stays unpaired
  std::vector<Bin> bins = {17, 200, 359, 0, 90, 123};
  bins.resize(l);
  const auto x = x_sd(code, bins);
  const Paired paired_code(code, bins);
  const SignedColumns columns = paired_code.lists.columns();
  std::size_t n_active = 0, n_listed = 0;
  for (std::size_t j = 0; j < x.size(); ++j) {
    if (x[j] != 0) n_active += code.columns_of(j).paired ? 1 : 2;
  }
  for (const auto* list : {&columns.plus, &columns.minus}) {
    n_listed += list->size();  // columns that stand for two units come first
    EXPECT_TRUE(std::ranges::is_partitioned(
        *list, [&](std::uint32_t j) { return j < code.n_double_columns(); }));
  }
  // An active unit of a pair takes half a column, as it shares one; an unpaired unit takes one.
  EXPECT_EQ(2 * n_listed, n_active);
}

// Two paired units share two columns; an unpaired unit has a column of its own.
TEST_P(StateCodeOfInputs, EveryColumnOfThePairedCodeStandsForOneOrTwoUnits) {
  const auto code = GetParam().code(13, 5);
  std::vector<int> n_uses(code.n_columns(), 0);
  for (std::size_t j = 0; j < code.n_columns(); ++j) {
    const auto columns = code.columns_of(j);
    EXPECT_EQ(columns.paired, columns.first < code.n_double_columns());
    ++n_uses[columns.first];
    if (columns.paired) ++n_uses[columns.second];
  }
  for (std::size_t j = 0; j < n_uses.size(); ++j) {
    EXPECT_EQ(n_uses[j], j < code.n_double_columns() ? 2 : 1);
  }
  EXPECT_THROW(static_cast<void>(code.columns_of(code.n_columns())), std::invalid_argument);
}

// Columns whose entries change are listed, so that sums over columns can follow a change of state.
TEST_P(StateCodeOfInputs, ChangesOfColumnsEqualTheDifferenceOfCodes) {
  const std::size_t l = GetParam().l;
  const auto code = GetParam().code(50, 6);
  core::Random random(2, core::Stream::ties);
  ColumnLists changes = code.column_lists();
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<Bin> from(l), to(l);
    for (auto& bin : from) bin = static_cast<Bin>(random.below(360));
    for (auto& bin : to) bin = static_cast<Bin>(random.below(360));
    changes.read_changes(Paired(code, from).view(), Paired(code, to).view());
    const auto change = dense(code.n_columns(), changes.columns());
    const auto before = paired(code, from);
    const auto after = paired(code, to);
    for (std::size_t j = 0; j < change.size(); ++j) ASSERT_EQ(change[j], after[j] - before[j]);
  }
}

TEST_P(StateCodeOfInputs, InnerProductsOfBinsEqualThoseOfDenseCodes) {
  const std::size_t l = GetParam().l;
  const auto code = GetParam().code(50, 6);
  core::Random random(1, core::Stream::ties);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Bin> a(l), b(l);
    for (auto& bin : a) bin = static_cast<Bin>(random.below(360));
    for (auto& bin : b) bin = static_cast<Bin>(random.below(360));
    const auto x = x_sd(code, a);
    const auto y = x_sd(code, b);
    int expected = 0;
    for (std::size_t j = 0; j < x.size(); ++j) expected += x[j] * y[j];
    EXPECT_EQ(code.inner_product(a, b), expected);
    EXPECT_EQ(code.inner_product(b, a), expected);
  }
}

// The squared norm of a code is its number of active columns. In each of 4 * 3 pairs of inputs a
// column is active where the modifier's anchor pattern is on, which half of its units are.
TEST(StateCode, AnAnchorStateHasHalfOfItsColumnsActive) {
  const auto code = small_code(4, 64, 7);
  const std::vector<Bin> anchors = {0, 45, 90, 135};
  EXPECT_EQ(code.inner_product(anchors, anchors), 4 * 3 * (64 / 2));
}

// Two inputs have two ordered pairs, each with a permutation of the 3 pattern units. Three inputs
// have three of them per stride, which is a distance between paired inputs, 1 or 2.
TEST(StateCode, RefusesBadPermutationsAndStrides) {
  const auto code = small_code(2, 3, 9);
  const std::vector<PatternTable> tables = {code.table(0), code.table(1)};
  EXPECT_THROW(StateCode({code.table(0)}, {}), std::invalid_argument);
  EXPECT_THROW(StateCode(tables, {{0, 1, 2}}), std::invalid_argument);
  EXPECT_THROW(StateCode(tables, {{0, 1, 2}, {0, 1, 1}}), std::invalid_argument);
  EXPECT_NO_THROW(StateCode(tables, {{0, 1, 2}, {2, 1, 0}}));
  EXPECT_THROW(static_cast<void>(code.permutation(1, 1)), std::invalid_argument);
  const std::vector<PatternTable> three = {code.table(0), code.table(1), code.table(0)};
  const std::vector<Permutation> permutations = {{0, 1, 2}, {2, 1, 0}, {1, 0, 2}};
  EXPECT_NO_THROW(StateCode(three, permutations, {2}));
  EXPECT_THROW(StateCode(three, permutations), std::invalid_argument);  // all pairs need six
  EXPECT_THROW(StateCode(three, permutations, {0}), std::invalid_argument);
  EXPECT_THROW(StateCode(three, permutations, {3}), std::invalid_argument);
  EXPECT_THROW(StateCode(three, permutations, {2, 1}), std::invalid_argument);
  EXPECT_THROW(StateCode(three, permutations, {1, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::coding
