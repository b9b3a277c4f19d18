# Finds Eigen >= 3.4: a system package, or the PyPI wheel `cmeel-eigen`, below CMAKE_PREFIX_PATH or in the
# Python that the shell would start. Makes the target Eigen3::Eigen, or sets sdnn_eigen_missing to an error.
macro(_sdnn_find_eigen)
  # One major version at a time, because the configuration file of Eigen 3.4.0 refuses ranges.
  foreach(_sdnn_eigen_version 3.4 5)
    if(NOT TARGET Eigen3::Eigen)
      find_package(Eigen3 ${_sdnn_eigen_version} CONFIG QUIET ${ARGN}
                   PATH_SUFFIXES cmeel.prefix/share/eigen3/cmake)
    endif()
  endforeach()
endmacro()

_sdnn_find_eigen()
if(NOT TARGET Eigen3::Eigen)
  find_program(_sdnn_python NAMES python3 python NO_CACHE)
  if(_sdnn_python)
    execute_process(
      COMMAND "${_sdnn_python}" -c "import sysconfig; print(sysconfig.get_path('purelib'), end='')"
      OUTPUT_VARIABLE _sdnn_site_packages ERROR_QUIET)
    _sdnn_find_eigen(HINTS "${_sdnn_site_packages}")
  endif()
endif()
set(sdnn_eigen_missing "")
if(NOT TARGET Eigen3::Eigen)
  string(CONCAT sdnn_eigen_missing
    "sdnn needs Eigen >= 3.4: pip install cmeel-eigen, apt install libeigen3-dev, "
    "or set -DEigen3_DIR=<folder with Eigen3Config.cmake>")
endif()
