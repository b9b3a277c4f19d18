#include "sdnn/estimators/detail/transposition.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "instruction_sets.hpp"

namespace sdnn {
namespace {

template <class Item>
void check_transposition() {
  for (const std::size_t n_rows : {0U, 1U, 8U, 16U, 17U, 40U}) {
    for (const std::size_t n_columns : {1U, 8U, 16U, 21U}) {
      const std::size_t from_stride = n_columns + 5;
      const std::size_t to_stride = n_rows + 3;
      std::vector<Item> from(n_rows * from_stride);
      for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<Item>(7 * i + 1);
      std::vector<Item> expected(n_columns * to_stride, -1);
      for (std::size_t r = 0; r < n_rows; ++r) {
        for (std::size_t c = 0; c < n_columns; ++c) {
          expected[c * to_stride + r] = from[r * from_stride + c];
        }
      }
      testing::on_every_instruction_set([&](auto level) {
        std::vector<Item> to(n_columns * to_stride, -1);
        estimators::transpose(from.data(), from_stride, n_rows, n_columns, to.data(), to_stride);
        EXPECT_EQ(to, expected) << level << ' ' << n_rows << " x " << n_columns;
      });
    }
  }
}

TEST(Transposition, MovesEveryItem) {
  check_transposition<std::int16_t>();
  check_transposition<std::int32_t>();
}

}  // namespace
}  // namespace sdnn
