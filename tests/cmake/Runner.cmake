# The runner of a Unity program: it calls every TEST of a source (tests/c/test.h) in their order.
# Without CMake's build: cmake -D source=FILE -D runner=FILE -P Runner.cmake

# Write the runner of a source. A source with a main of its own calls run_tests.
function(lm_write_runner source runner)
  file(STRINGS ${source} found REGEX "^TEST\\(")
  if(NOT found)
    message(FATAL_ERROR "${source}: no TEST, expected one or more")
  endif()
  string(REGEX REPLACE "TEST\\(([a-zA-Z0-9_]+)\\)[^;]*" "\\1" tests "${found}")
  set(declared "")
  set(called "")
  foreach(test IN LISTS tests)
    string(APPEND declared "void ${test}(void);\n")
    string(APPEND called "  RUN_TEST(${test});\n")
  endforeach()
  set(main "int run_tests(void);\n\nint run_tests(void) {\n")
  file(STRINGS ${source} own_main REGEX "^int main\\(")
  if(NOT own_main)
    set(main "int main(void) {\n")
  endif()
  set(content "#include <unity.h>\n\n${declared}\n${main}")
  string(APPEND content "  UnityBegin(\"${source}\");\n${called}  return UNITY_END();\n}\n")
  file(CONFIGURE OUTPUT ${runner} CONTENT "@content@" @ONLY)
endfunction()

# Add the runner of a source to its program.
function(lm_add_runner target source)
  set(runner ${CMAKE_CURRENT_BINARY_DIR}/${target}_runner.c)
  lm_write_runner(${source} ${runner})
  target_sources(${target} PRIVATE ${runner})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
endfunction()

if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  lm_write_runner(${source} ${runner})
endif()
