/// Kernels: functions that are compiled for every instruction set, with a choice at run time.
///
/// All code for an instruction set is a kernel. A kernel `name` in a package's namespace has a
/// version for each level in the nested namespace `detail`: name_portable, name_neon, name_avx2,
/// name_avx512. It is exact: sums of integers, or floating-point operations in a fixed order, so
/// that all versions give the same bits. SDNN_KERNEL makes all versions from one body. If some
/// versions are written by hand, SDNN_KERNEL_PORTABLE, SDNN_KERNEL_NEON, SDNN_KERNEL_AVX2 and
/// SDNN_KERNEL_AVX512 make the others, and SDNN_DISPATCH makes the function that chooses. A new
/// level needs an enumerator of core::InstructionSet, a macro like these and a line in
/// SDNN_DISPATCH.
#pragma once

#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

// `parameters` and `arguments` are lists in parentheses. The function `name_body` in `detail`, and
// everything that it calls, must be SDNN_INLINE, so that it is compiled inside each version.

// A program of several units may compile these versions once, in a unit that defines
// SDNN_KERNELS_HERE before all includes; all units are compiled with SDNN_KERNELS_ELSEWHERE.
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

// Builds for NEON may use it everywhere, so their portable version already does.
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
