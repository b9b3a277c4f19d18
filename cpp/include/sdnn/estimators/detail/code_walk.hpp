/// Potentials of many samples, each from those of the sample before on a short walk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/core/detail/integer_register.hpp"
#include "sdnn/core/instruction_set.hpp"
#include "sdnn/estimators/detail/code_changes.hpp"
#include "sdnn/estimators/detail/tile_rows.hpp"

namespace sdnn::estimators {

/// Words of a code whose rows of weights are added together: 128 columns of 96 units in 16 bits fit
/// into the first cache.
inline constexpr std::size_t kChunkWords = 2;
inline constexpr std::size_t kChunkColumns = 64 * kChunkWords;

/// Units that are added side by side, in six registers.
template <class Weight>
inline constexpr std::size_t kMostUnits = 6 * core::IntegerRegister<Weight>::kSize;

namespace detail {

#if SDNN_LANES && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

/// entries[k] = bit k of `plus` less bit k of `minus`, for 32 bits.
SDNN_INLINE void expand_bits(std::uint32_t plus, std::uint32_t minus,
                             std::int8_t* entries) noexcept {
#if SDNN_LANES
  using Bytes = core::IntegerRegister<std::int8_t>;
  typedef std::uint8_t Bits __attribute__((vector_size(32)));
  constexpr Bits kOwn = {1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128,  //
                         1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
  const auto all_ones_if_set = [&](std::uint32_t bits) SDNN_INLINE_LAMBDA {
    typedef std::uint32_t Copies __attribute__((vector_size(32)));
    const Bits copies = (Bits)(Copies{} + bits);
    const Bits own = __builtin_shufflevector(copies, copies,                                  //
                                             0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1,  //
                                             18, 18, 18, 18, 18, 18, 18, 18,                  //
                                             19, 19, 19, 19, 19, 19, 19, 19);
    return Bytes{(Bytes::Vector)((own & kOwn) == kOwn)};
  };
  Bytes{all_ones_if_set(minus).v - all_ones_if_set(plus).v}.store(entries);
#else
  for (int k = 0; k < 32; ++k) {
    entries[k] = static_cast<std::int8_t>(static_cast<int>(plus >> k & 1) -
                                          static_cast<int>(minus >> k & 1));
  }
#endif
}

#if SDNN_LANES && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

SDNN_INLINE void expand_code_body(const coding::CodeWords& code, std::size_t n_words,
                                  std::int8_t* entries, std::size_t chunk_stride) noexcept {
  for (std::size_t w = 0; w < n_words; w += kChunkWords, entries += chunk_stride) {
    for (std::size_t k = 0; k < kChunkWords; ++k) {
      const std::uint64_t plus = code.positive[w + k];
      const std::uint64_t minus = code.active[w + k] & ~plus;
      for (const std::size_t half : {0, 1}) {
        expand_bits(static_cast<std::uint32_t>(plus >> 32 * half),
                    static_cast<std::uint32_t>(minus >> 32 * half), entries + 64 * k + 32 * half);
      }
    }
  }
}

SDNN_INLINE std::uint8_t* list_chunk_changes_body(const coding::CodeWords& from,
                                                  const coding::CodeWords& to, std::size_t n_words,
                                                  std::uint8_t* at, std::uint8_t** ends) noexcept {
  for (std::size_t w = 0; w < n_words; w += kChunkWords) {
    for (const bool rising : {true, false}) {
      core::unrolled<kChunkWords>([&](std::size_t k) SDNN_INLINE_LAMBDA {
        const WordChanges changes(from, to, w + k);
        at = append_bits<4>(at, rising ? changes.up : changes.down, 64 * k);
        at = append_bits<4>(at, rising ? changes.up_again : changes.down_again, 64 * k);
      });
      *ends++ = at;
    }
  }
  return at;
}

}  // namespace detail

/// entries[chunk * chunk_stride + k] = the code's +1, 0 or -1 in column k of a chunk.
SDNN_KERNEL(void, expand_code,
            (const coding::CodeWords& code, std::size_t n_words, std::int8_t* entries,
             std::size_t chunk_stride),
            (code, n_words, entries, chunk_stride))

/// Lists what leads from one code to another, chunk by chunk: the columns that rise, one that rises
/// by 2 twice, then those that fall.
///
/// Writes numbers inside the chunk from `at` on, at most 2 * 64 * n_words + 4, and where each list
/// ends. Returns the end. `n_words` is a multiple of kChunkWords.
SDNN_KERNEL(std::uint8_t*, list_chunk_changes,
            (const coding::CodeWords& from, const coding::CodeWords& to, std::size_t n_words,
             std::uint8_t* at, std::uint8_t** ends),
            (from, to, n_words, at, ends))

/// Samples in the order of a walk, and the columns in which each code differs from the one before.
class CodeWalk {
 public:
  /// A sample of the walk.
  struct Stop {
    std::uint32_t sample;
    bool afresh;  ///< from nothing, not from the sample before
  };
  /// In one chunk, stop by stop: columns that rise, then columns that fall, and how many there are.
  struct Changes {
    struct Count {
      std::uint16_t rising;
      std::uint16_t falling;
    };
    std::vector<std::uint8_t> columns;
    std::vector<Count> counts;
  };

  CodeWalk() = default;
  /// Through codes of n_words, a multiple of kChunkWords, along `order`; code_of(sample) has to
  /// stay where it is until the walk is made.
  template <class CodeOf>
  CodeWalk(std::span<const std::uint32_t> order, std::size_t n_words, const CodeOf& code_of)
      : chunks_(n_words / kChunkWords) {
    const std::vector<std::uint64_t> nothing(n_words);
    std::vector<std::uint8_t> columns(2 * 64 * n_words + 4);
    std::vector<std::uint8_t*> ends(2 * chunks_.size());
    coding::CodeWords last{nothing.data(), nothing.data()};
    for (const std::uint32_t sample : order) {
      const coding::CodeWords code = code_of(sample);
      const auto list = [&](const coding::CodeWords& from) {
        const auto* const end =
            list_chunk_changes(from, code, n_words, columns.data(), ends.data());
        return static_cast<std::size_t>(end - columns.data());
      };
      bool afresh = stops_.empty();
      if (list(last) > n_active(code, n_words)) {
        list({nothing.data(), nothing.data()});
        afresh = true;
      }
      stops_.push_back({sample, afresh});
      const std::uint8_t* begin = columns.data();
      for (std::size_t c = 0; c < chunks_.size(); ++c) {
        const std::uint8_t* const middle = ends[2 * c];
        const std::uint8_t* const end = ends[2 * c + 1];
        chunks_[c].columns.insert(chunks_[c].columns.end(), begin, end);
        chunks_[c].counts.push_back(
            {static_cast<std::uint16_t>(middle - begin), static_cast<std::uint16_t>(end - middle)});
        begin = end;
      }
      last = code;
    }
  }

  /// The most bytes that walks through n_samples codes take.
  static std::size_t bytes(std::size_t n_samples, std::size_t n_words,
                           std::size_t most_active) noexcept {
    return n_samples * (most_active + n_words / kChunkWords * sizeof(Changes::Count));
  }

  bool empty() const noexcept { return stops_.empty(); }
  std::size_t n_chunks() const noexcept { return chunks_.size(); }
  std::span<const Stop> stops() const noexcept { return stops_; }
  const Changes& changes(std::size_t chunk) const noexcept { return chunks_[chunk]; }

 private:
  std::vector<Stop> stops_;
  std::vector<Changes> chunks_;
};

namespace detail {

template <class Weight>
SDNN_INLINE void walk_chunk_body(const Weight* rows, std::size_t width,
                                 std::span<const CodeWalk::Stop> stops,
                                 const CodeWalk::Changes& changes, std::int32_t* potentials,
                                 std::size_t stride) noexcept {
  using Lane = core::IntegerRegister<Weight>;
  for_width<kMostUnits<Weight>>(width, [&]<std::size_t Width>(Size<Width>) SDNN_INLINE_LAMBDA {
    constexpr std::size_t kRegisters = Width / Lane::kSize;
    Lane sum[kRegisters];
    core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
    const std::uint8_t* column = changes.columns.data();
    const CodeWalk::Changes::Count* count = changes.counts.data();
    for (const CodeWalk::Stop& stop : stops) {
      if (stop.afresh) {
        core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
      }
      for (const std::uint8_t* const end = column + count->rising; column != end; ++column) {
        const Weight* const row = rows + *column * Width;
        core::unrolled<kRegisters>([&](std::size_t r)
                                       SDNN_INLINE_LAMBDA { sum[r].add(row + r * Lane::kSize); });
      }
      for (const std::uint8_t* const end = column + count->falling; column != end; ++column) {
        const Weight* const row = rows + *column * Width;
        core::unrolled<kRegisters>(
            [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].subtract(row + r * Lane::kSize); });
      }
      ++count;
      std::int32_t* const to = potentials + stop.sample * stride;
      core::unrolled<kRegisters>([&](std::size_t r)
                                     SDNN_INLINE_LAMBDA { sum[r].add_to(to + r * Lane::kSize); });
    }
  });
}

}  // namespace detail

/// Adds to potentials[sample * stride + i], i = 0 .. width - 1, what the columns of a chunk
/// contribute to each sample of a walk. The sum over a sample's columns in the chunk has to fit
/// into Weight.
///
/// Shapes: rows (kChunkColumns, width).
SDNN_KERNEL(void, walk_chunk,
            (const std::int16_t* rows, std::size_t width, std::span<const CodeWalk::Stop> stops,
             const CodeWalk::Changes& changes, std::int32_t* potentials, std::size_t stride),
            (rows, width, stops, changes, potentials, stride))
SDNN_KERNEL(void, walk_chunk,
            (const std::int32_t* rows, std::size_t width, std::span<const CodeWalk::Stop> stops,
             const CodeWalk::Changes& changes, std::int32_t* potentials, std::size_t stride),
            (rows, width, stops, changes, potentials, stride))

}  // namespace sdnn::estimators
