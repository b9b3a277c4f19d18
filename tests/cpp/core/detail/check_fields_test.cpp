#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "sdnn/core/config_fields.hpp"

namespace sdnn::core {
namespace {

struct Numbers {
  double share = 0.5, rate = 1.0, any = 0.0;
  int count = 1;
  std::optional<double> last = {};
  std::vector<int> sizes = {};
  std::vector<bool> flags = {true, false};  // a vector whose items are proxies

  static constexpr auto fields() noexcept {
    return std::tuple(field("share", &Numbers::share, "", within(0, 1)),
                      field("rate", &Numbers::rate, "", above_up_to(0, 2)),
                      field("any", &Numbers::any, ""),
                      field("count", &Numbers::count, "", at_least(1)),
                      field("last", &Numbers::last, "", above(0)),
                      field("sizes", &Numbers::sizes, "", within(0, 1 << 20)),
                      field("flags", &Numbers::flags, ""));
  }
};

std::string refusal(const Numbers& numbers) {
  try {
    check_fields(numbers);
    return "";
  } catch (const ArgumentError& error) {
    EXPECT_EQ(std::string(error.what()).find(error.name() + " must be "), 0U);
    return error.what();
  }
}

TEST(CheckFields, AcceptsValuesWithinTheirBounds) {
  EXPECT_EQ(refusal({}), "");
  EXPECT_EQ(refusal({.share = 1.0, .rate = 2.0, .any = -1e300, .last = 1e-9, .sizes = {0, 7}}), "");
}

TEST(CheckFields, NamesTheFieldItsBoundsAndTheValue) {
  EXPECT_EQ(refusal({.share = 1.5}), "share must be in [0, 1], got 1.5");
  EXPECT_EQ(refusal({.share = std::nan("")}), "share must be in [0, 1], got nan");
  EXPECT_EQ(refusal({.rate = 0.0}), "rate must be in (0, 2], got 0");
  EXPECT_EQ(refusal({.any = INFINITY}), "any must be finite, got inf");
  EXPECT_EQ(refusal({.count = 0}), "count must be at least 1, got 0");
  EXPECT_EQ(refusal({.last = 0.0}), "last must be a finite number greater than 0, got 0");
  EXPECT_EQ(refusal({.sizes = {1, -1}}), "sizes must be in [0, 1048576], got -1");
}

}  // namespace
}  // namespace sdnn::core
