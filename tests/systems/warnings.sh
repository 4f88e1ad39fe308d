#!/bin/sh
# warnings.sh CLANG [PYTHON]: library, optimizer and the tests' machine.c under the compilers of
# other systems, every warning an error. CLANG stands for clang-cl and clang with the headers of
# mingw-w64 (Debian: clang, mingw-w64); PYTHON has the package ziglang, whose compiler contains the
# headers of macOS.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
clang=$1 python=${2:-}
cd "$root"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Two names of NLopt that search.c needs; its own headers are made by its build.
found=$(find build*/_deps/nlopt-* /usr/include -name nlopt.h 2>/dev/null | head -n 1 || true)
[ -n "$found" ] || { echo "no nlopt.h: apt install libnlopt-dev"; exit 1; }
cp "$found" "$work"
includes="-Ilib/include -Ilib -Ilib/design -Ioptimizer"
warnings="-Wall -Wextra -Wpedantic -Wgnu -Wconversion -Wshadow -Werror -Wno-unused-command-line-argument"
library=$(find lib -name '*.c' | LC_ALL=C sort)
all="$library $(find optimizer -name '*.c' | LC_ALL=C sort) tests/c/machine.c"
mingw=/usr/x86_64-w64-mingw32/include
failed=0

# The names of the sources are words to be split.
# shellcheck disable=SC2086
check() {
  name=$1
  shift
  if "$@"; then echo "$name: no warning"; else failed=1; echo "$name: failed"; fi
}

# shellcheck disable=SC2086
if [ -d $mingw ]; then
  for bits in 64 32; do
    check "clang-cl /W4, library in $bits bits" "$clang" --driver-mode=cl \
      --target=x86_64-pc-windows-msvc /W4 /WX -Wgnu -Wno-unused-command-line-argument /Zs \
      /DLM_REAL_BITS=$bits /imsvc $mingw $includes $library
  done
  check "clang for Windows" "$clang" --target=x86_64-w64-windows-gnu -std=c99 $warnings -Wmicrosoft \
    -fsyntax-only $includes -isystem "$work" $all
else
  echo "Windows: left out, apt install mingw-w64"
fi
# shellcheck disable=SC2086
if [ -n "$python" ] && "$python" -c 'import ziglang' 2>/dev/null; then
  for target in x86_64-macos aarch64-macos; do
    check "zig cc for $target" "$python" -m ziglang cc -target $target -std=c99 $warnings \
      '-DLM_EMULATOR=""' -fsyntax-only $includes -isystem "$work" $all
  done
else
  echo "macOS: left out, pip install ziglang"
fi
exit $failed
