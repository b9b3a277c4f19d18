/// Version of this library.
#pragma once

namespace sdnn::core {

/// The library's version, as in CMakeLists.txt.
inline constexpr const char* kVersion = "0.1.0";

}  // namespace sdnn::core
