#!/bin/sh
# fuzz_runtime.sh CLANG COUNT [FOLDER]: COUNT fuzzed calls of the runtime and COUNT fuzzed blobs,
# under ASan and UBSan. Prints their numbers; exit 0 if nothing was found. The corpus is stored in
# FOLDER, and the next run continues with it.
set -eu
clang=$1
count=$2
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
folder=${3:-$root/build-fuzz}
mkdir -p "$folder"

# An input contains many calls, or two blobs, which the target itself counts. It therefore runs in
# rounds, each with its count in the last line, until there are enough.
fuzz() { # fuzz NAME RUNS_A_ROUND
  "$clang" -std=c99 -O1 -g -fsanitize=fuzzer,address,undefined,float-cast-overflow \
    -fno-sanitize-recover=all -ffp-contract=off -DLM_REAL_BITS=32 -DLM_PROFILE=LM_PROFILE_FULL \
    -I "$root/lib/include" -I "$root/lib" "$root/tests/fuzz/$1.c" "$root"/lib/status.c \
    "$root"/lib/runtime/*.c "$root"/lib/runtime/effects/*.c -o "$folder/$1"
  mkdir -p "$folder/$1.corpus"
  total=0
  seed=1
  while [ "$total" -lt "$count" ]; do
    if ! "$folder/$1" -runs="$2" -seed="$seed" -max_len=1200 -len_control=0 -timeout=10 \
      -verbosity=0 -artifact_prefix="$folder/" "$folder/$1.corpus" >"$folder/$1.log" 2>&1; then
      tail -n 40 "$folder/$1.log"
      return 1
    fi
    made=$(tail -n 1 "$folder/$1.log")
    total=$((total + ${made%% *}))
    seed=$((seed + 1))
  done
  printf '%s: %s %s, nothing found\n' "$1" "$total" "${made#* }"
}

fuzz runtime_step $((count / 40 + 1000))
fuzz runtime_blob $((count / 8 + 1000))
