# Gives the target NLopt::nlopt: the system's NLopt (Debian: libnlopt-dev), else a pinned release
# built as a static library. Set FETCHCONTENT_SOURCE_DIR_NLOPT to build from a tree of your own.
if(NOT LM_BUNDLE_NLOPT)
  find_package(NLopt 2.7.1 QUIET CONFIG)
endif()
if(TARGET NLopt::nlopt)
  return()
endif()
if(NOT LM_FETCH AND NOT LM_BUNDLE_NLOPT AND NOT FETCHCONTENT_SOURCE_DIR_NLOPT)
  message(FATAL_ERROR "NLopt >= 2.7.1 not found. Install it (Debian, Ubuntu: libnlopt-dev), set "
    "FETCHCONTENT_SOURCE_DIR_NLOPT to its source tree, allow the download with -DLM_FETCH=ON, or "
    "leave the optimizer out with -DLM_BUILD_OPTIMIZER=OFF.")
endif()

# A function, so that what is set for NLopt's build ends here.
function(lm_build_nlopt)
  include(FetchContent)
  # Homebrew, MXE and Drake state the same checksum for this archive.
  FetchContent_Declare(nlopt
    URL https://github.com/stevengj/nlopt/archive/refs/tags/v2.10.0.tar.gz
    URL_HASH SHA256=506f83a9e778ad4f204446e99509cb2bdf5539de8beccc260a014bd560237be1
    SOURCE_SUBDIR none) # no such folder: it is only fetched here and added below
  FetchContent_MakeAvailable(nlopt)
  # NLopt asks for a CMake so old that newer ones no longer know its rules; and its options must not
  # override what is set here.
  set(CMAKE_POLICY_VERSION_MINIMUM 3.5)
  set(CMAKE_POLICY_DEFAULT_CMP0077 NEW)
  foreach(part CXX FORTRAN PYTHON OCTAVE MATLAB GUILE JAVA SWIG LUKSAN TESTS)
    set(NLOPT_${part} OFF)
  endforeach()
  set(BUILD_SHARED_LIBS OFF)
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
  # EXCLUDE_FROM_ALL keeps NLopt's own install rules out of ours.
  add_subdirectory(${nlopt_SOURCE_DIR} ${nlopt_BINARY_DIR} EXCLUDE_FROM_ALL)
endfunction()
lm_build_nlopt()
if(NOT TARGET NLopt::nlopt)
  add_library(NLopt::nlopt ALIAS nlopt)
endif()
