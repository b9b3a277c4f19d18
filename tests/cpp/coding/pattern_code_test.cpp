#include "sdnn/coding/pattern_code.hpp"

#include <gtest/gtest.h>

namespace sdnn::coding {
namespace {

using Book = CodeBook<256>;

Book paper_book(std::uint64_t seed, PatternCodeConfig config = {}) {
  core::Random random(seed, core::Stream::code_books);
  return anchor_interpolation<256>(config, random);
}

TEST(PatternCode, ThePaperHas360PatternsOf200Units) {
  const Book book = paper_book(1);
  EXPECT_EQ(book.n_bins(), 360U);
  EXPECT_EQ(book.n_pattern_units(), 200U);
}

TEST(PatternCode, AnchorsAreBalancedAndEveryPatternNearlySo) {
  const Book book = paper_book(2);
  for (std::size_t anchor = 0; anchor < 8; ++anchor) {
    EXPECT_EQ(book[static_cast<Bin>(45 * anchor)].count(), 100U);
  }
}

TEST(PatternCode, OddPatternsAreBalancedToOneUnit) {
  const Book book = paper_book(2, {.n_pattern_units = 7});
  EXPECT_EQ(book[0].count(), 3U);
}

// Between two anchors every differing unit flips once: distances to the first anchor are the cuts
// floor(j * differing / 45), and the last portion leads to the next anchor.
TEST(PatternCode, NeighboursDifferByNearlyEqualPortions) {
  const Book book = paper_book(3);
  for (std::size_t segment = 0; segment + 1 < 8; ++segment) {
    const auto first = static_cast<Bin>(45 * segment);
    const std::size_t differing = (book[first] ^ book[static_cast<Bin>(first + 45)]).count();
    for (std::size_t j = 0; j < 45; ++j) {
      const auto here = static_cast<Bin>(first + j);
      EXPECT_EQ((book[first] ^ book[here]).count(), j * differing / 45);
      EXPECT_EQ((book[here] ^ book[static_cast<Bin>(first + 45)]).count(),
                differing - j * differing / 45);
    }
  }
}

TEST(PatternCode, ACircularBookEndsNextToItsBeginning) {
  const Book straight = paper_book(4);
  const Book circular = paper_book(4, {.circular = true});
  EXPECT_LE((circular[359] ^ circular[0]).count(), 4U);
  EXPECT_GT((straight[359] ^ straight[0]).count(), 60U);
  EXPECT_EQ(straight[100], circular[100]);  // only the last segment differs
}

TEST(PatternCode, BinsAreHalfOpenAndOneFallsIntoTheLast) {
  const Book book = paper_book(5);
  EXPECT_EQ(book.bin_of(0.0), 0);
  EXPECT_EQ(book.bin_of(1.0 / 360 * 0.999), 0);
  EXPECT_EQ(book.bin_of(0.5), 180);
  EXPECT_EQ(book.bin_of(0.9999999), 359);
  EXPECT_EQ(book.bin_of(1.0), 359);
}

TEST(PatternCode, NamesWhatIsImpossible) {
  const auto message = [](PatternCodeConfig config) -> std::string {
    try {
      paper_book(1, config);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message({.n_pattern_units = 1}), "n_pattern_units must be in [2, 1048576], got 1");
  EXPECT_EQ(message({.n_anchor_patterns = 1}), "n_anchor_patterns must be in [2, 10000], got 1");
  EXPECT_EQ(message({.n_interpolated = -1}), "n_interpolated must be in [0, 10000], got -1");
  EXPECT_THROW(paper_book(1, {.n_pattern_units = 257}), std::length_error);
}

}  // namespace
}  // namespace sdnn::coding
