#include "sdnn/estimators/correction_rules.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

namespace {

using namespace sdnn;
using estimators::ClassScheme;
using Pairs = std::vector<std::pair<std::uint32_t, std::int32_t>>;

/// The corrections by a sample, as pairs (unit, direction) in the order of units.
template <class Rule>
Pairs corrections_of(Rule& rule, std::size_t sample, const std::vector<std::int32_t>& potentials) {
  std::vector<estimators::Correction> corrections;
  rule(sample, potentials.data(), corrections);
  Pairs pairs;
  for (const auto& c : corrections) pairs.emplace_back(c.unit, c.direction);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

// A target is the number of units that should fire. The rule is applied to each of eight samples
// with a target; results are (unit, direction) pairs.
TEST(PDeltaRule, CorrectsTheNearestUnitsAndOfEqualOnesTheLowestIndex) {
  const std::vector<std::int32_t> potentials{5, -2, 0, 3, -2, -9};  // units 0 and 3 fire
  estimators::PDeltaRule rule(6, std::vector<double>{2.0, 4.0, 1.0, 3.49, 3.5, 0.0, 99.0, -99.0},
                              1);
  EXPECT_EQ(corrections_of(rule, 0, potentials), Pairs{});  // the target of 2 is met
  // Two more shall fire: unit 2 is nearest, then units 1 and 4, of which 1 has the lower index.
  EXPECT_EQ(corrections_of(rule, 1, potentials), (Pairs{{1, 1}, {2, 1}}));
  EXPECT_EQ(corrections_of(rule, 2, potentials), (Pairs{{3, -1}}));  // one less: 3 is nearer than 5
  EXPECT_EQ(corrections_of(rule, 3, potentials), (Pairs{{2, 1}}));   // rounds to 3
  EXPECT_EQ(corrections_of(rule, 4, potentials), (Pairs{{1, 1}, {2, 1}}));    // rounds to 4
  EXPECT_EQ(corrections_of(rule, 5, potentials), (Pairs{{0, -1}, {3, -1}}));  // all that fire
  EXPECT_EQ(corrections_of(rule, 6, potentials),
            (Pairs{{1, 1}, {2, 1}, {4, 1}, {5, 1}}));                         // all silent
  EXPECT_EQ(corrections_of(rule, 7, potentials), (Pairs{{0, -1}, {3, -1}}));  // -99 counts as 0
}

// Units 0 and 1 should both be active, units 2 and 3 both inactive. Results are (unit, direction).
TEST(PDeltaRule, GroupsOfUnitsAreCorrectedSeparately) {
  estimators::PDeltaRule rule(4, std::vector<double>{2.0, 0.0}, 2);
  EXPECT_EQ(corrections_of(rule, 0, {1, -1, 1, -1}), (Pairs{{1, 1}, {2, -1}}));
}

TEST(PDeltaRule, CorrectsAShareOfTheDeficit) {
  const std::vector<std::int32_t> potentials{5, -2, 0, 3, -2, -9, -4, -1, 0};
  estimators::PDeltaRule rule(9, std::vector<double>{3.0, 4.0, 8.0, 9.0, 0.0}, 1, 0.25);
  // A quarter of the deficit, rounded, but at least one unit: two of the nine units fire.
  EXPECT_EQ(corrections_of(rule, 0, potentials), (Pairs{{2, 1}}));          // (3 - 2) / 4 = 0.25
  EXPECT_EQ(corrections_of(rule, 1, potentials), (Pairs{{2, 1}}));          // (4 - 2) / 4 = 0.5
  EXPECT_EQ(corrections_of(rule, 2, potentials), (Pairs{{2, 1}, {8, 1}}));  // (8 - 2) / 4 = 1.5
  EXPECT_EQ(corrections_of(rule, 3, potentials), (Pairs{{2, 1}, {8, 1}}));  // (9 - 2) / 4 = 1.75
  EXPECT_EQ(corrections_of(rule, 4, potentials), (Pairs{{3, -1}}));
}

TEST(PDeltaRule, ComparesDistancesNear32BitsExactly) {
  const std::int32_t far = 2000000000;  // near 2^31: no bits are left for an index beside it
  estimators::PDeltaRule rule(3, std::vector<double>{1.0, 2.0}, 1);
  EXPECT_EQ(corrections_of(rule, 0, {-far, 1 - far, -far}), (Pairs{{1, 1}}));
  EXPECT_EQ(corrections_of(rule, 1, {-far, 1 - far, -far}), (Pairs{{0, 1}, {1, 1}}));
  EXPECT_EQ(corrections_of(rule, 0, {far, far, 7}), (Pairs{{0, -1}, {2, -1}}));  // 3 fire, 1 should
}

TEST(ClassScheme, SchemesHaveNamesAndNumbersOfUnits) {
  for (const auto scheme : estimators::kClassSchemes) {
    EXPECT_EQ(estimators::class_scheme_named(estimators::name_of(scheme)), scheme);
  }
  EXPECT_EQ(estimators::n_units_for(estimators::class_scheme_named("one_vs_rest"), 4), 4U);
  EXPECT_EQ(estimators::n_units_for(estimators::class_scheme_named("one_vs_one"), 4), 4U * 3 / 2);
  EXPECT_THROW(estimators::class_scheme_named("one_vs_two"), std::invalid_argument);
  EXPECT_THROW(estimators::n_units_for(ClassScheme::one_vs_one, 1), std::invalid_argument);
}

// The sample is of class 1 of three: unit 1 should fire, units 0 and 2 should not.
TEST(PerceptronRule, OneVersusRestCorrectsUnitsOfWrongSign) {
  estimators::PerceptronRule rule(3, std::vector<std::int32_t>{1}, 3, ClassScheme::one_vs_rest);
  EXPECT_EQ(corrections_of(rule, 0, {1, 0, -1}), (Pairs{{0, -1}, {1, 1}}));
  EXPECT_EQ(corrections_of(rule, 0, {0, 1, 0}), Pairs{});
}

TEST(PerceptronRule, OneVersusOneCorrectsTheUnitsOfTheClass) {
  // Units (0,1) (0,2) (0,3) (1,2) (1,3) (2,3): a unit should fire for its first class, and be
  // silent for its second. All others are left alone.
  const std::vector<std::int32_t> labels{0, 2, 3};
  estimators::PerceptronRule rule(6, labels, 4, ClassScheme::one_vs_one);
  EXPECT_EQ(corrections_of(rule, 0, {0, 0, 0, 0, 0, 0}), (Pairs{{0, 1}, {1, 1}, {2, 1}}));
  EXPECT_EQ(corrections_of(rule, 1, {1, 1, 1, 1, 1, 0}), (Pairs{{1, -1}, {3, -1}, {5, 1}}));
  EXPECT_EQ(corrections_of(rule, 2, {1, 1, 1, 1, 1, 1}), (Pairs{{2, -1}, {4, -1}, {5, -1}}));
}

TEST(CorrectionRules, RefuseBadArguments) {
  const std::vector<double> targets{1.0, 1.0}, nan{1.0, std::nan("")};
  using estimators::PDeltaRule, estimators::PerceptronRule;
  EXPECT_THROW(PDeltaRule(4, nan, 1), std::invalid_argument);
  EXPECT_THROW(PDeltaRule(3, targets, 2), std::invalid_argument);  // no two equal groups
  EXPECT_THROW(PDeltaRule(4, targets, 0), std::invalid_argument);
  EXPECT_THROW(PDeltaRule(0, targets, 1), std::invalid_argument);
  for (const double share : {0.0, -1.0, 1.01, std::nan("")}) {
    EXPECT_THROW(PDeltaRule(4, targets, 1, share), std::invalid_argument);
  }
  const std::vector<std::int32_t> labels{0, 3};  // of four classes or more
  EXPECT_THROW(PerceptronRule(3, labels, 3, ClassScheme::one_vs_rest), std::invalid_argument);
  EXPECT_THROW(PerceptronRule(3, labels, 4, ClassScheme::one_vs_rest), std::invalid_argument);
  EXPECT_THROW(PerceptronRule(1, labels, 1, ClassScheme::one_vs_one), std::invalid_argument);
}

}  // namespace
