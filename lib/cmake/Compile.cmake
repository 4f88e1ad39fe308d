# lm_compile(<target>): options of every C target of this project. All are PRIVATE: a consumer's
# own sources keep the consumer's flags.
#
# -ffp-contract=off: a fused multiply-add rounds once where the source rounds twice, so a compiler
# that fuses gives other bits on a core with FMA than on one without. GCC fuses by default in its
# gnu dialects. With the option off every target computes the same bits.
#
# -fno-math-errno: nothing reads the errno of a mathematical function, so a square root is one
# instruction, without the branch and the call for a negative argument. The bits are the same.
#
# Position-independent code is for shared libraries. On a controller, which has none, it would put
# constant tables into RAM.
function(lm_compile target)
  set_target_properties(${target} PROPERTIES
    C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF)
  get_property(shared GLOBAL PROPERTY TARGET_SUPPORTS_SHARED_LIBS)
  if(shared)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  endif()
  if(NOT CMAKE_C_COMPILER_ID MATCHES "GNU|Clang")
    return()
  endif()
  target_compile_options(${target} PRIVATE
    -ffp-contract=off -fno-math-errno
    -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wdouble-promotion
    -Wshadow $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes;-Wmissing-prototypes;-Wc++-compat>
    $<$<BOOL:${LM_WERROR}>:-Werror>)
  if(MINGW) # its isfinite and isnan pass their argument to a function of every precision
    target_compile_options(${target} PRIVATE -Wno-float-conversion)
  endif()
  if(LM_SANITIZE)
    target_compile_options(${target} PRIVATE
      -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=address,undefined)
  endif()
  if(LM_COVERAGE)
    target_compile_options(${target} PRIVATE --coverage -O0 -fprofile-update=atomic)
    target_link_options(${target} PUBLIC --coverage)
  endif()
endfunction()
