#!/bin/sh
# pkg_config.sh CC PREFIX SOURCE OUT NAME: builds SOURCE with the flags that pkg-config gives for NAME
# installed under PREFIX, and runs it.
set -eu
cc=$1 prefix=$2 source=$3 out=$4 name=$5
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name "$name.pc")")
export PKG_CONFIG_PATH
# The flags are words to be split.
# shellcheck disable=SC2046
"$cc" "$source" $(pkg-config --cflags --define-variable=prefix="$prefix" "$name") \
  $(pkg-config --libs --define-variable=prefix="$prefix" "$name") -o "$out"
"$out"
