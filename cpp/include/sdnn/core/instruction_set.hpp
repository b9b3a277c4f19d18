/// The choice at run time of the vector instructions that kernels use.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>

#include "sdnn/core/errors.hpp"

#if (defined(__x86_64__) || defined(_M_X64)) && (defined(__GNUC__) || defined(__clang__))
#define SDNN_X86_KERNELS 1
#else
#define SDNN_X86_KERNELS 0
#endif

// Every AArch64 processor has NEON; 32-bit builds use it only if compiled for it (-mfpu=neon).
#if defined(__ARM_NEON) && (defined(__GNUC__) || defined(__clang__))
#define SDNN_NEON_KERNELS 1
#else
#define SDNN_NEON_KERNELS 0
#endif

namespace sdnn::core {

/// Levels of instruction sets. Those of one processor are in rising order: x86 has portable, avx2
/// and avx512, Arm has portable and neon. Results have the same bits on all of them.
enum class InstructionSet {
  portable,  ///< plain loops
  neon,      ///< Arm's Advanced SIMD
  avx2,
  avx512,  ///< AVX-512 F and BW
};

/// The level's name, as the environment variable SDNN_INSTRUCTION_SET spells it.
inline std::string_view name_of(InstructionSet level) noexcept {
  constexpr std::array<std::string_view, 4> kNames{"portable", "neon", "avx2", "avx512"};
  return kNames[static_cast<std::size_t>(level)];
}

inline constexpr std::array kInstructionSets = {InstructionSet::portable, InstructionSet::neon,
                                                InstructionSet::avx2, InstructionSet::avx512};

/// Whether this processor, its operating system and this build offer the level.
inline bool offers(InstructionSet level) noexcept {
  switch (level) {
    case InstructionSet::portable:
      return true;
#if SDNN_NEON_KERNELS
    case InstructionSet::neon:
      return true;
#endif
#if SDNN_X86_KERNELS
    case InstructionSet::avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
             __builtin_cpu_supports("popcnt");
    case InstructionSet::avx512:
      return offers(InstructionSet::avx2) && __builtin_cpu_supports("avx512f") &&
             __builtin_cpu_supports("avx512bw");
#endif
    default:
      return false;
  }
}

/// The highest available level.
inline InstructionSet best_instruction_set() noexcept {
  InstructionSet best = InstructionSet::portable;
  for (const InstructionSet level : kInstructionSets) {
    if (offers(level)) best = level;
  }
  return best;
}

/// Returns the level called `name`. Throws std::invalid_argument, with all names that this
/// processor accepts, for any other name; `source` says where the name comes from.
inline InstructionSet instruction_set_named(std::string_view name, const std::string& source) {
  std::string accepted;
  for (const InstructionSet level : kInstructionSets) {
    if (!offers(level)) continue;
    if (name == name_of(level)) return level;
    accepted.append(accepted.empty() ? "" : ", ").append(name_of(level));
  }
  fail(std::invalid_argument(source + " must be one of " + accepted + " on this processor, got " +
                             std::string(name)));
}

namespace detail {

/// The level in use: at first that of SDNN_INSTRUCTION_SET or, without it, the processor's best.
inline std::atomic<InstructionSet>& active_level() {
  static std::atomic<InstructionSet> level = [] {
    constexpr const char* kVariable = "SDNN_INSTRUCTION_SET";
    const char* const name = std::getenv(kVariable);
    return name == nullptr ? best_instruction_set() : instruction_set_named(name, kVariable);
  }();
  return level;
}

}  // namespace detail

/// The current level: the highest, unless SDNN_INSTRUCTION_SET or set_instruction_set chose
/// another.
///
/// Throws std::invalid_argument on the first call if the environment variable is unusable.
inline InstructionSet instruction_set() {
  return detail::active_level().load(std::memory_order_relaxed);
}

/// Forces a level for the whole process. Throws std::invalid_argument unless it is offered.
inline void set_instruction_set(std::string_view name) {
  const InstructionSet level = instruction_set_named(name, "instruction set");
  detail::active_level().store(level, std::memory_order_relaxed);
}

}  // namespace sdnn::core
