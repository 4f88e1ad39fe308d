# Defines the target `unity`, ThrowTheSwitch's Unity, which is shipped as source. Searched in
# UNITY_SRC_DIR (variable or environment), in Debian's package cmock, in the project's own release
# archive, and last in the other Debian packages that contain it.
set(unity_version 2.6.1)
# The same checksum is in several public build files that pin this archive, for example that of
# maplibre-native-ffi.
set(unity_sha256 b41a66d45a6b99758fb3202ace6178177014d52fc524bf1f72687d93e9867292)

set(deps_dir ${PROJECT_BINARY_DIR}/deps)
find_path(UNITY_SRC_DIR unity.c
  HINTS ENV UNITY_SRC_DIR
  PATHS /usr/share/cmock/vendor/unity/src ${deps_dir}/Unity-${unity_version}/src ${deps_dir}/debian
  NO_DEFAULT_PATH
  DOC "Folder that holds unity.c and unity.h")

if(NOT UNITY_SRC_DIR AND LM_FETCH)
  set(archive ${deps_dir}/unity-${unity_version}.tar.gz)
  file(DOWNLOAD
    https://github.com/ThrowTheSwitch/Unity/archive/refs/tags/v${unity_version}.tar.gz ${archive}
    STATUS status TIMEOUT 120 INACTIVITY_TIMEOUT 20)
  list(GET status 0 failed)
  if(NOT failed)
    file(SHA256 ${archive} found_sha256)
    if(NOT found_sha256 STREQUAL unity_sha256)
      message(FATAL_ERROR
        "Unity's archive has the SHA256 ${found_sha256}, expected ${unity_sha256}.")
    endif()
    file(ARCHIVE_EXTRACT INPUT ${archive} DESTINATION ${deps_dir})
    set(unity_dir ${deps_dir}/Unity-${unity_version}/src)
  else()
    message(STATUS "Unity's own repository was not reached (${status}); trying Debian's packages")
    execute_process(COMMAND sh ${CMAKE_CURRENT_LIST_DIR}/unity_from_debian.sh ${deps_dir}/debian
      RESULT_VARIABLE failed)
    set(unity_dir ${deps_dir}/debian)
  endif()
  if(NOT failed)
    set_property(CACHE UNITY_SRC_DIR PROPERTY VALUE ${unity_dir})
  endif()
endif()
if(NOT UNITY_SRC_DIR)
  message(FATAL_ERROR "Unity not found. Set UNITY_SRC_DIR to the folder with its unity.c, allow the "
    "download with -DLM_FETCH=ON, or leave the tests out with -DLM_BUILD_TESTS=OFF.")
endif()
message(STATUS "Unity: ${UNITY_SRC_DIR}")

add_library(unity STATIC ${UNITY_SRC_DIR}/unity.c)
target_include_directories(unity SYSTEM PUBLIC ${UNITY_SRC_DIR})
target_compile_definitions(unity PUBLIC UNITY_INCLUDE_DOUBLE)
