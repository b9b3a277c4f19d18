/// Lists of the high bytes of weights that need more than a byte.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/core/detail/aligned_buffer.hpp"

namespace sdnn::approximators {

/// The high byte of a weight, whose unit is numbered within its block.
struct HighByte {
  std::uint32_t column;
  std::uint8_t unit;
  std::int8_t value;
};

/// The lists of the high bytes other than 0, one for each block of units. A block that ever had
/// more than `capacity` of them stays overfull: its high bytes are counted and no longer listed.
class HighByteLists {
 public:
  HighByteLists() = default;
  HighByteLists(std::size_t n_blocks, std::size_t capacity)
      : capacity_(capacity),
        lists_(core::checked_product(n_blocks, capacity)),
        sizes_(n_blocks),
        is_overfull_(n_blocks) {}

  /// The number of high bytes in all blocks.
  std::size_t size() const noexcept { return size_; }
  std::size_t size_of(std::size_t block) const noexcept { return sizes_[block]; }
  bool is_overfull(std::size_t block) const noexcept { return is_overfull_[block] != 0; }
  /// The list of a block, empty if the block is overfull.
  std::span<const HighByte> of(std::size_t block) const noexcept {
    return {lists_.data() + block * capacity_, is_overfull(block) ? 0 : sizes_[block]};
  }

  /// Writes to all memory of the lists, without a change of values, so that the operating system
  /// provides its pages now.
  void touch_memory() noexcept {
    for (HighByte& high : lists_.span()) {
      std::int8_t volatile& value = high.value;
      value = value;
    }
  }
  /// Records that the high byte of a column and unit of the block changes from the value `before`
  /// to that of `now`. A byte that becomes 0 leaves the list, and the last entry takes its place.
  void change(std::size_t block, std::int8_t before, const HighByte& now) noexcept {
    if (before == now.value) return;
    const std::size_t size = sizes_[block];
    sizes_[block] += static_cast<std::size_t>(now.value != 0) - (before != 0 ? 1U : 0U);
    size_ += sizes_[block] - size;
    if (is_overfull(block)) return;
    HighByte* const list = lists_.data() + block * capacity_;
    if (before == 0) {
      is_overfull_[block] = size == capacity_ ? 1 : 0;
      if (size < capacity_) list[size] = now;
      return;
    }
    HighByte* const changed = std::find_if(list, list + size, [&now](const HighByte& high) {
      return high.column == now.column && high.unit == now.unit;
    });
    assert(changed != list + size);
    *changed = now.value != 0 ? now : list[size - 1];
  }

 private:
  std::size_t capacity_ = 0;
  core::AlignedBuffer<HighByte> lists_;  ///< [block][list]
  std::vector<std::size_t> sizes_;
  std::vector<std::uint8_t> is_overfull_;
  std::size_t size_ = 0;
};

}  // namespace sdnn::approximators
