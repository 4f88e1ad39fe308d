#!/bin/sh
# run_elsewhere.sh SYSTEM FOLDER [REGEX]: builds library, optimizer and Unity programs for another
# system into FOLDER, warnings as errors, and runs them in its emulator: those whose names match.
#   windows   mingw-w64 and Wine     (Debian: mingw-w64, wine64)
#   aarch64   gcc and QEMU           (Debian: g++-aarch64-linux-gnu, qemu-user)
# Optimizer and tests are the same on every system; a test that a system cannot run states this.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
system=$1 regex=${3:-.}
mkdir -p "$2"
folder=$(CDPATH='' cd -- "$2" && pwd)
if [ "$system" = windows ]; then
  # A separate folder for Wine, so that the user's is not changed.
  WINEPREFIX=$folder/wine WINEDEBUG=-all
  export WINEPREFIX WINEDEBUG
fi
if [ ! -f "$folder/build.ninja" ]; then
  nlopt=${NLOPT_SOURCE:-$(sh "$root/optimizer/nlopt_from_debian.sh" "$folder/nlopt" || true)}
  cmake -S "$root" -B "$folder" -G Ninja --toolchain "$root/tests/systems/$system.cmake" \
    -DLM_WERROR=ON -DLM_BUILD_TESTS=ON -DLM_BUILD_OPTIMIZER=ON -DLM_INSTALL=OFF \
    -DLM_BUNDLE_NLOPT=ON ${nlopt:+-DFETCHCONTENT_SOURCE_DIR_NLOPT="$nlopt"} >"$folder/configure.log" ||
    { cat "$folder/configure.log"; exit 1; }
fi
cmake --build "$folder" >"$folder/build.log" || { tail -n 40 "$folder/build.log"; exit 1; }
(cd "$folder" && ctest --output-on-failure -R "$regex")
# Ctrl-C needs a console, which Wine has only on a terminal.
if [ "$system" = windows ] && [ "$regex" = . ]; then
  (cd "$folder/tests/c" &&
    timeout 60 script -qec "$(command -v wine64 || echo /usr/lib/wine/wine64) ./test_optimizer_run.exe interrupt" \
      "$folder/interrupt.log" </dev/null >/dev/null) || { cat "$folder/interrupt.log"; exit 1; }
  echo "Ctrl-C on a console: the search wrote what it had and ended with 130"
fi
