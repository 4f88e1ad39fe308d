# Gives the target NLopt::nlopt: the system's NLopt (Debian: libnlopt-dev), else a pinned release
# built as a static library. Set FETCHCONTENT_SOURCE_DIR_NLOPT to build from your own source tree,
# for example that of nlopt_from_debian.sh. Only parts under permissive licences are built: the part
# of NLopt under the LGPL (luksan) is left out.
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

# A function, so that the settings for NLopt's build are local.
function(lm_build_nlopt)
  include(FetchContent)
  # Homebrew, MXE and Drake state the same checksum for this archive.
  FetchContent_Declare(nlopt
    URL https://github.com/stevengj/nlopt/archive/refs/tags/v2.10.0.tar.gz
    URL_HASH SHA256=506f83a9e778ad4f204446e99509cb2bdf5539de8beccc260a014bd560237be1
    SOURCE_SUBDIR none) # no such folder: it is only fetched here and added below
  FetchContent_MakeAvailable(nlopt)
  # NLopt requires so old a CMake that newer ones do not support its policies; and its options must
  # not override the settings here.
  set(CMAKE_POLICY_VERSION_MINIMUM 3.5)
  # Its headers are made by separate scripts at build time, which the variable does not affect.
  list(APPEND CMAKE_COMMAND -DCMAKE_POLICY_VERSION_MINIMUM=3.5)
  set(CMAKE_POLICY_DEFAULT_CMP0077 NEW)
  foreach(part CXX FORTRAN PYTHON OCTAVE MATLAB GUILE JAVA SWIG LUKSAN TESTS)
    set(NLOPT_${part} OFF)
  endforeach()
  set(CMAKE_POLICY_DEFAULT_CMP0063 NEW) # hidden, if the enclosing project sets it
  set(BUILD_SHARED_LIBS OFF)
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
  # EXCLUDE_FROM_ALL keeps NLopt's own install rules out of ours.
  add_subdirectory(${nlopt_SOURCE_DIR} ${nlopt_BINARY_DIR} EXCLUDE_FROM_ALL)
  # Its assertions name their files: without the folder of the build.
  if(CMAKE_C_COMPILER_ID MATCHES "GNU|Clang")
    target_compile_options(nlopt PRIVATE -ffile-prefix-map=${nlopt_SOURCE_DIR}=nlopt)
  endif()
  # Before 2.8 there is no option that leaves luksan out. Its sources are removed, and its
  # algorithms, of which the search uses none, return an error.
  get_target_property(sources nlopt SOURCES)
  if(sources MATCHES "luksan")
    list(FILTER sources EXCLUDE REGEX "/luksan/[^/]*\\.c$")
    set(absent ${nlopt_BINARY_DIR}/absent.c)
    file(WRITE ${absent} "")
    foreach(name plis plip pnet)
      target_compile_definitions(nlopt PRIVATE luksan_${name}=lm_absent_${name})
      file(APPEND ${absent} "int lm_absent_${name}(void);\n"
        "int lm_absent_${name}(void) { return -2; /* NLOPT_INVALID_ARGS */ }\n")
    endforeach()
    set_target_properties(nlopt PROPERTIES SOURCES "${sources};${absent}")
  endif()
endfunction()
lm_build_nlopt()
if(NOT TARGET NLopt::nlopt)
  add_library(NLopt::nlopt ALIAS nlopt)
endif()
