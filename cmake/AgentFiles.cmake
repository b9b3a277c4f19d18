# sdnn::agent_files is sdnn::sdnn and nlohmann/json, which the headers of saved agents include
# (core/safetensors.hpp, agents/agent_file.hpp). sdnn::controller is the library behind
# agents/compiled_controller.hpp; it is compiled only if a program links to it.
find_package(nlohmann_json 3.9 CONFIG QUIET)
if(TARGET nlohmann_json::nlohmann_json AND NOT TARGET sdnn::agent_files)
  add_library(sdnn::agent_files INTERFACE IMPORTED GLOBAL)
  target_link_libraries(sdnn::agent_files INTERFACE sdnn::sdnn nlohmann_json::nlohmann_json)
  get_property(sdnn_languages GLOBAL PROPERTY ENABLED_LANGUAGES)
  if("CXX" IN_LIST sdnn_languages)
    find_file(sdnn_controller_file compiled_controller.cpp NO_CACHE REQUIRED NO_DEFAULT_PATH
      PATHS "${CMAKE_CURRENT_LIST_DIR}" "${CMAKE_CURRENT_LIST_DIR}/../cpp/compiled")
    add_library(sdnn_controller STATIC EXCLUDE_FROM_ALL "${sdnn_controller_file}")
    set_target_properties(sdnn_controller PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_link_libraries(sdnn_controller PUBLIC sdnn::sdnn PRIVATE sdnn::agent_files)
    add_library(sdnn::controller ALIAS sdnn_controller)
  endif()
elseif(NOT TARGET nlohmann_json::nlohmann_json)
  # CMake stops at an expression $<...> that it cannot evaluate and shows it: that is the error message of a
  # project that links to a target without nlohmann/json. Others configure without an error.
  foreach(sdnn_target sdnn::agent_files sdnn::controller)
    add_library(${sdnn_target} INTERFACE IMPORTED GLOBAL)
    set_property(TARGET ${sdnn_target} PROPERTY INTERFACE_LINK_LIBRARIES
      "$<${sdnn_target} needs nlohmann/json: apt install nlohmann-json3-dev>")
  endforeach()
endif()
