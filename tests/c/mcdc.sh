#!/bin/sh
# mcdc.sh CLANG FOLDER: branch and MC/DC coverage of the runtime by its unit tests, in each
# precision. Lines are gcovr's (./dev check): LLVM counts every copy of an inline function
# separately. CLANG is clang-18 or later with llvm-profdata and llvm-cov of the same release beside
# it; UNITY_SRC_DIR contains Unity. Exit 1 if anything is below 100 %.
set -eu
clang=$1
folder=$2
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
release=$(printf '%s' "$clang" | sed -n 's/.*clang\(-[0-9]*\)$/\1/p')
mkdir -p "$folder"
result=0
for bits in 64 32; do
  rm -f "$folder"/*.profraw "$folder"/*.o
  flags="-std=c99 -O0 -ffp-contract=off -fprofile-instr-generate -fcoverage-mapping -fcoverage-mcdc"
  flags="$flags -DLM_REAL_BITS=$bits -DLM_PROFILE=LM_PROFILE_FULL"
  # The flags are words to be split.
  # shellcheck disable=SC2086
  (cd "$folder" && "$clang" $flags -I "$root/lib/include" -I "$root/lib" -I "$UNITY_SRC_DIR" -c \
    "$root"/lib/status.c "$root"/lib/runtime/*.c "$root"/lib/runtime/effects/*.c \
    "$UNITY_SRC_DIR/unity.c")
  objects=''
  for module in curve play effects elementary model parameters torque compensator status; do
    program=$folder/$module$bits
    cmake -D source="$root/tests/c/test_$module.c" -D runner="$program.c" \
      -P "$root/tests/cmake/Runner.cmake"
    # shellcheck disable=SC2086
    "$clang" $flags -I "$root/lib/include" -I "$root/lib" -I "$UNITY_SRC_DIR" \
      "$root/tests/c/test_$module.c" "$program.c" "$folder"/*.o -lm -o "$program"
    LLVM_PROFILE_FILE="$program.profraw" "$program" >"$program.log" || {
      tail -n 20 "$program.log"
      exit 1
    }
    objects="$objects -object $program"
  done
  "llvm-profdata$release" merge "$folder"/*.profraw -o "$folder/all.profdata"
  # The names of the objects are words to be split.
  # shellcheck disable=SC2086
  "llvm-cov$release" export $objects -instr-profile="$folder/all.profdata" -summary-only \
    -sources "$root"/lib/runtime "$root/lib/status.c" >"$folder/summary.json"
  python3 - "$folder/summary.json" $bits <<'EOP' || result=1
import json
import sys

with open(sys.argv[1]) as file:
    data = json.load(file)["data"][0]
kinds = ("branches", "mcdc")
missed = [
    f"{entry['filename']}: {kind} {found['covered']} of {found['count']}"
    for entry in data["files"]
    for kind in kinds
    if (found := entry["summary"][kind])["covered"] < found["count"]
]
totals = [(kind, data["totals"][kind]) for kind in kinds]
said = ", ".join(f"{kind} {found['covered']} of {found['count']}" for kind, found in totals)
print("\n".join([*missed, f"{sys.argv[2]} bits: {said}"]))
sys.exit(1 if missed or not all(found["count"] for _, found in totals) else 0)
EOP
done
exit $result
