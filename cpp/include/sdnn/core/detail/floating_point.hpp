/// Refuses older standards than C++20, and flags under which floating-point results would depend on
/// the compiler or the processor.
///
/// The CMake target sdnn::sdnn sets the required options. Without CMake, g++ and clang need
/// -ffp-contract=off, and -DSDNN_NO_CONTRACTION to declare it, because a compiler does not show it;
/// /fp:precise of MSVC is the default.
#pragma once

#if (defined(_MSVC_LANG) ? _MSVC_LANG : __cplusplus) <= 201703L
#error "sdnn needs C++20: compile with -std=c++20, or /std:c++20"
#endif

#include <limits>

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0) || \
    defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) ||                         \
    defined(__NO_SIGNED_ZEROS__) || defined(_M_FP_FAST)
#error "sdnn: results would not be exact with -ffast-math, -Ofast, /fp:fast or parts of them"
#endif

#if (defined(__GNUC__) && !defined(SDNN_NO_CONTRACTION)) || defined(_M_FP_CONTRACT)
#error "sdnn: compile with -ffp-contract=off -DSDNN_NO_CONTRACTION, as the CMake target sdnn::sdnn"
#endif

static_assert(std::numeric_limits<double>::is_iec559 && std::numeric_limits<double>::digits == 53,
              "sdnn needs IEEE 754 doubles");
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0
#error "sdnn: doubles must not be computed with more digits: compile with -msse2 -mfpmath=sse"
#endif
