#include "sdnn/core/pcg64.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "states.hpp"

namespace sdnn::core {
namespace {

using Seeds = std::vector<std::uint64_t>;

struct ExpectedDraws {
  Seeds seeds;
  std::array<std::uint32_t, 5> below_7;
  double uniform;
  std::uint32_t below_2_20;
  std::uint64_t bits;
};

// Numbers of numpy.random.Generator(PCG64(SeedSequence(seeds))): integers, random, integers, raw.
TEST(Pcg64, DrawsTheNumbersOfNumPy) {
  const std::vector<ExpectedDraws> drawn = {
      {{0}, {5, 4, 3, 1, 2}, 0.016527635528529094, 42963, 15002187965291974971U},
      {{5, 4294967296}, {6, 5, 3, 2, 6}, 0.4106650053839328, 718495, 17808439220834274975U},
      {{9223372036854775813U, 4294967297},
       {1, 4, 2, 2, 2},
       0.15769863079913804,
       739458,
       3353183172323727852U}};
  for (const ExpectedDraws& expected : drawn) {
    Pcg64 random(expected.seeds);
    for (const std::uint32_t number : expected.below_7) EXPECT_EQ(random.below(7), number);
    EXPECT_EQ(random.uniform(), expected.uniform);
    EXPECT_EQ(random.below(1 << 20), expected.below_2_20);
    EXPECT_EQ(random.below(1), 0U);
    EXPECT_EQ(random.bits(), expected.bits);
  }
}

TEST(Pcg64, DrawsTheWordsOfNumPysSeedSequence) {
  // np.random.SeedSequence([1, 2, 3, 4, 5, 6]).generate_state(4, np.uint64)
  const std::array<std::uint32_t, 6> entropy{1, 2, 3, 4, 5, 6};
  const std::array<std::uint64_t, 4> expected{16991237094181161505U, 14981931853785751691U,
                                              11178459300072584630U, 1971961610505447179U};
  EXPECT_EQ(Pcg64::generated_state(entropy), expected);
}

TEST(Pcg64, ContinuesFromItsStateAndRefusesDamagedOnes) {
  Pcg64 random(Seeds{1, 2}), restored(Seeds{3});
  (void)random.below(5);  // a draw of 32 bits, so that half of 64 bits is left
  restore(restored, state_of(random));
  for (int i = 0; i < 9; ++i) EXPECT_EQ(random.below(1000), restored.below(1000));
  testing::expect_damaged_states_refused(random);
}

}  // namespace
}  // namespace sdnn::core
