#!/bin/sh
# names_f32.sh [--check]: writes lib/include/lostmotion/names_f32.h from the functions and tables
# that the other public headers declare, but for those that names_sized.h names; with --check says
# whether it would change.
set -eu
export LC_ALL=C
include=$(CDPATH='' cd -- "$(dirname -- "$0")/../include/lostmotion" && pwd)
target=$include/names_f32.h
fresh=$(mktemp)
sized=$(mktemp)
trap 'rm -f "$fresh" "$sized"' EXIT
sed -n 's/^#define \(lm_[a-z_]*\) .*/\1/p' "$include/names_sized.h" >"$sized"

{
  cat <<'EOF'
/* Public symbols of the float32 build: each carries the suffix _f32. */
#ifndef LOSTMOTION_NAMES_F32_H
#define LOSTMOTION_NAMES_F32_H

EOF
  for header in "$include"/*.h; do
    [ "$header" = "$target" ] || cat "$header"
  done | awk '
    # Comments and preprocessor lines go, so that only declarations are left.
    {
      line = $0
      text = ""
      while (line != "") {
        if (in_comment) {
          end = index(line, "*/")
          if (!end) break
          line = substr(line, end + 2)
          in_comment = 0
        } else {
          start = index(line, "/*")
          if (!start) {
            text = text line
            break
          }
          text = text substr(line, 1, start - 1)
          line = substr(line, start + 2)
          in_comment = 1
        }
      }
      continued = in_macro
      in_macro = (in_macro || text ~ /^[ \t]*#/) && text ~ /\\$/
      if (continued || text ~ /^[ \t]*#/) next
      while (match(text, /(^|[^A-Za-z0-9_])lm_[a-z0-9_A-Z]*[ \t]*\(/)) {
        name = substr(text, RSTART, RLENGTH)
        gsub(/[^A-Za-z0-9_]/, "", name)
        print name
        text = substr(text, RSTART + RLENGTH)
      }
      if (text ~ /^extern const / && match(text, /lm_[A-Za-z0-9_]*[ \t]*(\[|;)/)) {
        name = substr(text, RSTART, RLENGTH)
        gsub(/[^A-Za-z0-9_]/, "", name)
        print name
      }
    }' | sort -u | grep -vxFf "$sized" | sed 's/.*/#define & &_f32/'
  printf '\n#endif\n'
} >"$fresh"

if cmp -s "$fresh" "$target"; then
  exit 0
fi
if [ "${1:-}" = --check ]; then
  diff "$target" "$fresh" || true
  echo "names_f32.h does not match the headers: run ./dev names"
  exit 1
fi
cat "$fresh" >"$target"
echo "wrote lib/include/lostmotion/names_f32.h"
