# Clang and libc++ for many targets (pip install ziglang); SDNN_ZIG_TARGET is one of `zig targets`.
find_program(SDNN_ZIG python-zig REQUIRED)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SDNN_ZIG_TARGET)
if(SDNN_ZIG_TARGET MATCHES wasm)
  set(CMAKE_SYSTEM_NAME Generic)
  set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
else()
  set(CMAKE_SYSTEM_NAME Linux)
endif()
string(REGEX MATCH "^[^-]+" CMAKE_SYSTEM_PROCESSOR "${SDNN_ZIG_TARGET}")
if(CMAKE_SYSTEM_PROCESSOR STREQUAL arm)
  set(CMAKE_CROSSCOMPILING_EMULATOR qemu-arm)
endif()
set(CMAKE_CXX_COMPILER "${SDNN_ZIG}" c++ -target ${SDNN_ZIG_TARGET})
set(CMAKE_AR "${SDNN_ZIG}" CACHE FILEPATH "")
set(CMAKE_CXX_ARCHIVE_CREATE "<CMAKE_AR> ar qc <TARGET> <OBJECTS>")
set(CMAKE_CXX_ARCHIVE_FINISH "")
set(CMAKE_CXX_COMPILER_LAUNCHER "")  # zig has its own cache

# The host's package is in /usr/include, which would bring the headers of the host's C library along.
set(nlohmann_json_DIR "${CMAKE_BINARY_DIR}/nlohmann")
file(WRITE "${nlohmann_json_DIR}/nlohmann_jsonConfig.cmake" [[
file(MAKE_DIRECTORY "${CMAKE_CURRENT_LIST_DIR}/include")
file(CREATE_LINK "/usr/include/nlohmann" "${CMAKE_CURRENT_LIST_DIR}/include/nlohmann" SYMBOLIC)
add_library(nlohmann_json::nlohmann_json INTERFACE IMPORTED GLOBAL)
target_include_directories(nlohmann_json::nlohmann_json SYSTEM INTERFACE "${CMAKE_CURRENT_LIST_DIR}/include")
]])
file(WRITE "${nlohmann_json_DIR}/nlohmann_jsonConfigVersion.cmake" [[
set(PACKAGE_VERSION 3.9)  # at least: that of Debian and Ubuntu is newer
set(PACKAGE_VERSION_COMPATIBLE TRUE)
]])
