#!/bin/sh
# fuzz_journal.sh CLANG COUNT [FOLDER]: COUNT foreign journals under ASan and UBSan. Prints their
# number; exit 0 if nothing was found. The corpus is stored in FOLDER; earlier findings are in
# corpus/journal and are tried first.
set -eu
clang=$1
count=$2
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
folder=${3:-$root/build-fuzz}
mkdir -p "$folder/fuzz_journal.corpus"
# No task is computed, so the model's derivatives, a C++ part, are not linked.
printf '%s\n' '#include <stdlib.h>' 'void lm_dual_evaluate(void);' \
  'void lm_dual_evaluate(void) { abort(); }' 'size_t lm_dual_workspace_size(void);' \
  'size_t lm_dual_workspace_size(void) { return 0; }' >"$folder/no_derivatives.c"
sources=$(find "$root/optimizer" -name '*.c' ! -name main.c)
# The names of the sources are words to be split.
# shellcheck disable=SC2086
"$clang" -std=c99 -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
  -ffp-contract=off -D_GNU_SOURCE -I "$root/lib/include" -I "$root/lib" -I "$root/lib/design" \
  -I "$root/optimizer" -I "$root/tests/fuzz" "$root/tests/fuzz/fuzz_journal.c" \
  "$folder/no_derivatives.c" $sources "$root"/lib/*.c "$root"/lib/design/*.c \
  "$root"/lib/runtime/*.c "$root"/lib/runtime/effects/*.c -lnlopt -lm -lpthread \
  -o "$folder/fuzz_journal"
# A small quarantine: with the default most of the time is spent on new pages.
if ! ASAN_OPTIONS="quarantine_size_mb=8${ASAN_OPTIONS:+:$ASAN_OPTIONS}" \
  "$folder/fuzz_journal" -runs="$count" -seed=1 -max_len=2000 -len_control=0 -timeout=20 \
  -verbosity=0 -artifact_prefix="$folder/" "$folder/fuzz_journal.corpus" \
  "$root/tests/fuzz/corpus/journal" >"$folder/fuzz_journal.log" 2>&1; then
  tail -n 40 "$folder/fuzz_journal.log"
  exit 1
fi
printf 'fuzz_journal: %s, nothing found\n' "$(tail -n 1 "$folder/fuzz_journal.log")"
