# This folder as a component of ESP-IDF.
include(${CMAKE_CURRENT_LIST_DIR}/kconfig.cmake)
# Absolute: ESP-IDF resolves relative folders from the file with the call.
idf_component_register(SRCS ${lostmotion_sources}
  INCLUDE_DIRS ${lostmotion_dir}/include PRIV_INCLUDE_DIRS ${lostmotion_dir})
# The sizes are part of the structs: sources that include the headers need them too.
target_compile_definitions(${COMPONENT_LIB} PUBLIC ${lostmotion_definitions})
target_compile_options(${COMPONENT_LIB} PRIVATE -ffp-contract=off)
