# Sources of the run-time code, and the sizes chosen in Kconfig as compiler definitions, for build
# systems that configure by Kconfig (ESP-IDF, Zephyr).
get_filename_component(lostmotion_dir ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
file(GLOB_RECURSE lostmotion_sources ${lostmotion_dir}/runtime/*.c)
list(APPEND lostmotion_sources ${lostmotion_dir}/status.c)

set(lostmotion_definitions LM_REAL_BITS=32 LM_EFFECT_CARDS=0)
foreach(profile GAP STANDARD FULL)
  if(CONFIG_LOSTMOTION_PROFILE_${profile})
    list(APPEND lostmotion_definitions LM_PROFILE=LM_PROFILE_${profile})
  endif()
endforeach()
foreach(size CURVE_POINTS_MAX PLAYS_MAX EFFECTS_MAX EFFECT_MEMORY_MAX ENVELOPE)
  if(DEFINED CONFIG_LOSTMOTION_${size})
    list(APPEND lostmotion_definitions LM_${size}=${CONFIG_LOSTMOTION_${size}})
  endif()
endforeach()
