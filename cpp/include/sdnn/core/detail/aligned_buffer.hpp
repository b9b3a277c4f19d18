/// Storage of run-time size on cache-line boundaries.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include "sdnn/core/errors.hpp"

namespace sdnn::core {

/// The alignment of every AlignedBuffer, in bytes: one cache line.
inline constexpr std::size_t kCacheLine = 64;

/// The smallest multiple of `multiple` that is at least `n`.
constexpr std::size_t round_up(std::size_t n, std::size_t multiple) noexcept {
  return (n + multiple - 1) / multiple * multiple;
}

/// Returns n_rows * n_columns. Throws std::bad_alloc if std::size_t cannot hold the product.
inline std::size_t checked_product(std::size_t n_rows, std::size_t n_columns) {
  if (n_rows != 0 && n_columns > std::numeric_limits<std::size_t>::max() / n_rows) {
    fail(std::bad_alloc());
  }
  return n_rows * n_columns;
}

/// `size` zero-initialized items, aligned to a cache line; copied by value.
///
/// Throws std::bad_alloc without enough memory. Pages that are never written cost no memory where
/// the operating system hands out zero pages lazily.
template <class Item>
class AlignedBuffer {
  static_assert(std::is_trivially_copyable_v<Item>);

 public:
  AlignedBuffer() = default;
  explicit AlignedBuffer(std::size_t size) : size_(size) {
    if (size == 0) return;
    constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max() - kCacheLine;
    if (size > kMost / sizeof(Item)) fail(std::bad_alloc());
    // calloc does not touch the pages of large blocks. It may return any address, so the block has
    // room for an additional cache line, and the items begin at the next boundary in it.
    block_ = std::calloc(size * sizeof(Item) + kCacheLine, 1);
    if (block_ == nullptr) fail(std::bad_alloc());
    const auto beyond_boundary = reinterpret_cast<std::size_t>(block_) % kCacheLine;
    data_ =
        reinterpret_cast<Item*>(static_cast<std::byte*>(block_) + (kCacheLine - beyond_boundary));
  }
  AlignedBuffer(const AlignedBuffer& other) : AlignedBuffer(other.size_) {
    std::copy_n(other.data_, size_, data_);
  }
  AlignedBuffer(AlignedBuffer&& other) noexcept { swap(other); }
  AlignedBuffer& operator=(AlignedBuffer other) noexcept {
    swap(other);
    return *this;
  }
  ~AlignedBuffer() { std::free(block_); }

  std::size_t size() const noexcept { return size_; }
  Item* data() noexcept { return data_; }
  const Item* data() const noexcept { return data_; }
  Item& operator[](std::size_t i) noexcept { return data_[i]; }
  const Item& operator[](std::size_t i) const noexcept { return data_[i]; }
  std::span<Item> span() noexcept { return {data_, size_}; }
  std::span<const Item> span() const noexcept { return {data_, size_}; }

 private:
  void swap(AlignedBuffer& other) noexcept {
    std::swap(block_, other.block_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  void* block_ = nullptr;  ///< what calloc returned
  Item* data_ = nullptr;   ///< the first item, inside the block
  std::size_t size_ = 0;
};

}  // namespace sdnn::core
