# sdnn::agent_files is sdnn::sdnn and nlohmann/json, which the headers of saved agents include
# (core/safetensors.hpp, agents/agent_file.hpp): there if that library is.
find_package(nlohmann_json 3.9 CONFIG QUIET)
if(TARGET nlohmann_json::nlohmann_json AND NOT TARGET sdnn::agent_files)
  add_library(sdnn::agent_files INTERFACE IMPORTED GLOBAL)
  target_link_libraries(sdnn::agent_files INTERFACE sdnn::sdnn nlohmann_json::nlohmann_json)
elseif(NOT TARGET nlohmann_json::nlohmann_json AND NOT sdnn_FIND_QUIETLY)
  message(STATUS "sdnn::agent_files is left out: no nlohmann/json (apt install nlohmann-json3-dev)")
endif()
