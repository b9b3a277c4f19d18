/// Kernels: functions that are compiled for every instruction set, with a choice at run time.
///
/// All code for an instruction set is a kernel. A kernel `name` in a package's namespace has a
/// version for each level in the nested namespace `detail`: name_portable, name_neon, name_avx2,
/// name_avx512. All versions must give the same bits: a kernel may only add integers, or compute
/// with floating-point numbers in a fixed order.
///
/// SDNN_KERNEL makes all versions from one body:
///
///     namespace detail {
///     SDNN_INLINE int sum_body(const int* items, int n) { ... }
///     }
///     SDNN_KERNEL(int, sum, (const int* items, int n), (items, n))  // defines sum(items, n)
///
/// If some versions are written by hand, SDNN_KERNEL_PORTABLE, SDNN_KERNEL_NEON, SDNN_KERNEL_AVX2
/// and SDNN_KERNEL_AVX512 make the others, and SDNN_DISPATCH makes the function that chooses. A new
/// level needs a value of InstructionSet, such a macro and a line in SDNN_DISPATCH.
#pragma once

#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

// The function `name_body`, and everything that it calls, must be SDNN_INLINE: only then it is
// compiled inside each version, with the instructions of that version.

// Usually every translation unit compiles all versions, as inline functions. A program can compile
// them once instead: with SDNN_KERNELS_ELSEWHERE defined in all units, they are only declared, but
// for one unit that also defines SDNN_KERNELS_HERE before its includes.
#if defined(SDNN_KERNELS_ELSEWHERE) && !defined(SDNN_KERNELS_HERE)
#define SDNN_KERNEL_VERSION(attributes, Result, version, parameters, body) \
  namespace detail {                                                       \
  attributes Result version parameters;                                    \
  }
#else
#if defined(SDNN_KERNELS_HERE)
#define SDNN_KERNEL_LINKAGE
#else
#define SDNN_KERNEL_LINKAGE inline
#endif
#define SDNN_KERNEL_VERSION(attributes, Result, version, parameters, body)  \
  namespace detail {                                                        \
  attributes SDNN_KERNEL_LINKAGE Result version parameters { return body; } \
  }
#endif

#define SDNN_KERNEL_PORTABLE(Result, name, parameters, arguments) \
  SDNN_KERNEL_VERSION(, Result, name##_portable, parameters, name##_body arguments)

// In builds for NEON the compiler uses it in all code, so the version for NEON is the portable one.
#if SDNN_NEON_KERNELS
#define SDNN_KERNEL_NEON(Result, name, parameters, arguments) \
  SDNN_KERNEL_VERSION(, Result, name##_neon, parameters, name##_portable arguments)
#else
#define SDNN_KERNEL_NEON(Result, name, parameters, arguments)
#endif

#if SDNN_X86_KERNELS
#define SDNN_TARGET_AVX2 gnu::target("avx2,bmi,popcnt")
#define SDNN_TARGET_AVX512 gnu::target("avx512f,avx512bw,avx2,bmi,popcnt")
#define SDNN_KERNEL_AVX2(Result, name, parameters, arguments) \
  SDNN_KERNEL_VERSION([[SDNN_TARGET_AVX2]], Result, name##_avx2, parameters, name##_body arguments)
#define SDNN_KERNEL_AVX512(Result, name, parameters, arguments)                  \
  SDNN_KERNEL_VERSION([[SDNN_TARGET_AVX512]], Result, name##_avx512, parameters, \
                      name##_body arguments)
#else
#define SDNN_KERNEL_AVX2(Result, name, parameters, arguments)
#define SDNN_KERNEL_AVX512(Result, name, parameters, arguments)
#endif

#if SDNN_NEON_KERNELS

#define SDNN_DISPATCH(Result, name, parameters, arguments)       \
  inline Result name parameters {                                \
    return core::instruction_set() == core::InstructionSet::neon \
               ? detail::name##_neon arguments                   \
               : detail::name##_portable arguments;              \
  }

#elif SDNN_X86_KERNELS

#define SDNN_DISPATCH(Result, name, parameters, arguments) \
  inline Result name parameters {                          \
    switch (core::instruction_set()) {                     \
      case core::InstructionSet::avx512:                   \
        return detail::name##_avx512 arguments;            \
      case core::InstructionSet::avx2:                     \
        return detail::name##_avx2 arguments;              \
      default:                                             \
        return detail::name##_portable arguments;          \
    }                                                      \
  }

#else

#define SDNN_DISPATCH(Result, name, parameters, arguments) \
  inline Result name parameters { return detail::name##_portable arguments; }

#endif

#define SDNN_KERNEL(Result, name, parameters, arguments)    \
  SDNN_KERNEL_PORTABLE(Result, name, parameters, arguments) \
  SDNN_KERNEL_NEON(Result, name, parameters, arguments)     \
  SDNN_KERNEL_AVX2(Result, name, parameters, arguments)     \
  SDNN_KERNEL_AVX512(Result, name, parameters, arguments)   \
  SDNN_DISPATCH(Result, name, parameters, arguments)
