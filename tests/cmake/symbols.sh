#!/bin/sh
# symbols.sh NM SIZE LIB_DIR F64 F32 RUNTIME: permitted contents of the three libraries.
#   * both precisions have the same symbols, with the names in the headers; some have a second symbol
#     that contains precision and sizes (symbols.h);
#   * the only external calls are memcpy and similar functions, and from the design model those of
#     libm that lib/design/real_math.h lists;
#   * no variable: .data, .bss and their thread-local forms are empty.
set -eu
export LC_ALL=C
nm=$1 size=$2 lib_dir=$3 f64=$4 f32=$5 runtime=$6
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
: >"$work/complaints"

complain() { # complain TITLE < lines
  awk -v title="$1" '{print title ": " $0}' >>"$work/complaints"
}
defined() { "$nm" -g --defined-only "$1" 2>/dev/null | awk 'NF == 3 {print $3}' | sort -u; }
called() {
  "$nm" -g --undefined-only "$1" 2>/dev/null | awk 'NF == 2 {print $2}' | sort -u
}

defined "$f64" >"$work/f64"
defined "$f32" >"$work/f32"
defined "$runtime" >"$work/runtime"
[ -s "$work/f64" ] || { echo "no symbols read from $f64"; exit 1; }

grep -hv '^lm_' "$work/f64" "$work/f32" "$work/runtime" | complain "public without the prefix lm_"
grep '_f32$' "$work/f64" | complain "suffix _f32 in the float64 build"
grep -h '_f64$' "$work/f32" "$work/runtime" | complain "suffix _f64 in the float32 build"
sed 's/_f32$/_f64/' "$work/f32" | sort -u | comm -3 "$work/f64" - |
  complain "in one precision only (float64 left, float32 right)"
# Each symbol with sizes has a plain one.
for name in f64 f32 runtime; do
  sed -nE 's/(_[0-9]+){6}_f(32|64)$//p; s/_f(32|64)$//p' "$work/$name" | sort -u |
    comm -23 - "$work/$name" | complain "no plain symbol in $name"
done

printf '%s\n' memcpy memmove memset memcmp _GLOBAL_OFFSET_TABLE_ __stack_chk_fail \
  >"$work/allowed_runtime"
# The compiler combines a sine and a cosine of one angle into sincos.
{
  cat "$work/allowed_runtime"
  sed -n 's/^#define real_[a-z0-9_]* \([a-z0-9]*\)$/\1/p' "$lib_dir/design/real_math.h"
  printf '%s\n' sincos sincosf
} >"$work/allowed_design"
check_calls() { # check_calls NAME LIBRARY ALLOWED
  { cat "$work/$1" "$3"; } | sort -u >"$work/known"
  called "$2" | comm -23 - "$work/known" | complain "called from outside by $1"
}
check_calls f64 "$f64" "$work/allowed_design"
check_calls f32 "$f32" "$work/allowed_design"
check_calls runtime "$runtime" "$work/allowed_runtime"

# .data.rel.ro is constant: tables of pointers, relocated once at load.
for library in "$f64" "$f32" "$runtime"; do
  "$size" -A "$library" | awk '
    /:$/ || / :/ {member = $1}
    $1 ~ /^\.(data|bss|tdata|tbss|sdata|sbss)/ && $1 !~ /^\.data\.rel\.ro/ && $2 > 0 {
      print member, $1, $2, "bytes"}' | complain "variables in $(basename "$library")"
done
cat "$work/complaints"
[ ! -s "$work/complaints" ]
