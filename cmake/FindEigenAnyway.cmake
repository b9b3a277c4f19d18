# Finds Eigen >= 3.4 wherever it comes from: a system package, or the PyPI wheel `cmeel-eigen`.
# One major version at a time, because the configuration file of Eigen 3.4.0 refuses ranges.
foreach(_sdnn_eigen_version 3.4 5)
  if(NOT TARGET Eigen3::Eigen)
    find_package(Eigen3 ${_sdnn_eigen_version} CONFIG QUIET
                 PATH_SUFFIXES cmeel.prefix/share/eigen3/cmake)
  endif()
endforeach()
if(NOT TARGET Eigen3::Eigen)
  message(FATAL_ERROR "sdnn needs Eigen >= 3.4: pip install cmeel-eigen, apt install libeigen3-dev, "
                      "or set -DEigen3_DIR=<folder with Eigen3Config.cmake>")
endif()
