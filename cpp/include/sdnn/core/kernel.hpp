/// Loops that are written once and compiled for every instruction set.
#pragma once

#include "sdnn/core/instruction_set.hpp"
#include "sdnn/core/lanes.hpp"

/// Defines the function `name`, which runs `name_body` compiled for the instruction set in use.
///
/// `name_body` has to be SDNN_INLINE in the namespace `internal`, with everything that it calls, and
/// exact: sums of integers, so that all versions give the same result. To be used in a namespace
/// that has an `internal`; `parameters` and `arguments` are lists in parentheses.
#if SDNN_X86_KERNELS
#define SDNN_KERNEL(Result, name, parameters, arguments)                                           \
  namespace internal {                                                                             \
  [[gnu::target("avx2,bmi,popcnt")]] inline Result name##_avx2 parameters {                        \
    return name##_body arguments;                                                                  \
  }                                                                                                \
  [[gnu::target("avx512f,avx512bw,avx2,bmi,popcnt")]] inline Result name##_avx512 parameters {     \
    return name##_body arguments;                                                                  \
  }                                                                                                \
  }                                                                                                \
  inline Result name parameters {                                                                  \
    switch (core::instruction_set()) {                                                             \
      case core::InstructionSet::avx512: return internal::name##_avx512 arguments;                 \
      case core::InstructionSet::avx2: return internal::name##_avx2 arguments;                     \
      default: return internal::name##_body arguments;                                             \
    }                                                                                              \
  }
#else
#define SDNN_KERNEL(Result, name, parameters, arguments) \
  inline Result name parameters { return internal::name##_body arguments; }
#endif
