/// How often this test executable has called operator new.
#pragma once

#include <cstddef>

namespace sdnn::testing {

/// Calls of any operator new so far, in all threads.
std::size_t allocation_count() noexcept;

}  // namespace sdnn::testing
