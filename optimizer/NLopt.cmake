# Gives the target NLopt::nlopt: the system's NLopt (Debian: libnlopt-dev), else a pinned release
# built as a static library. Set FETCHCONTENT_SOURCE_DIR_NLOPT to build from a tree of your own.
if(NOT LM_BUNDLE_NLOPT)
  find_package(NLopt 2.7.1 QUIET CONFIG)
endif()
if(NOT TARGET NLopt::nlopt)
  if(NOT LM_FETCH AND NOT LM_BUNDLE_NLOPT AND NOT FETCHCONTENT_SOURCE_DIR_NLOPT)
    message(FATAL_ERROR "NLopt >= 2.7.1 not found. Install it (Debian, Ubuntu: libnlopt-dev), set "
      "FETCHCONTENT_SOURCE_DIR_NLOPT to its source tree, allow the download with -DLM_FETCH=ON, or "
      "leave the optimizer out with -DLM_BUILD_OPTIMIZER=OFF.")
  endif()
  foreach(part CXX FORTRAN PYTHON OCTAVE MATLAB GUILE JAVA SWIG LUKSAN TESTS)
    set(NLOPT_${part} OFF CACHE BOOL "" FORCE)
  endforeach()
  include(FetchContent)
  # The checksum is the one that conan-center-index states for this archive.
  FetchContent_Declare(nlopt
    URL https://github.com/stevengj/nlopt/archive/refs/tags/v2.7.1.tar.gz
    URL_HASH SHA256=db88232fa5cef0ff6e39943fc63ab6074208831dc0031cf1545f6ecd31ae2a1a)
  FetchContent_GetProperties(nlopt)
  if(NOT nlopt_POPULATED)
    FetchContent_Populate(nlopt)
    set(BUILD_SHARED_LIBS OFF)
    set(CMAKE_POSITION_INDEPENDENT_CODE ON)
    # EXCLUDE_FROM_ALL keeps NLopt's own install rules out of ours.
    add_subdirectory(${nlopt_SOURCE_DIR} ${nlopt_BINARY_DIR} EXCLUDE_FROM_ALL)
  endif()
  if(NOT TARGET NLopt::nlopt)
    add_library(NLopt::nlopt ALIAS nlopt)
  endif()
endif()
