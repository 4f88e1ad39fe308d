# This folder as a component of ESP-IDF.
include(${CMAKE_CURRENT_LIST_DIR}/kconfig.cmake)
idf_component_register(SRCS ${lostmotion_sources} INCLUDE_DIRS include PRIV_INCLUDE_DIRS .)
# The sizes are part of the structs: whoever includes the headers has to see them too.
target_compile_definitions(${COMPONENT_LIB} PUBLIC ${lostmotion_definitions})
target_compile_options(${COMPONENT_LIB} PRIVATE -ffp-contract=off)
