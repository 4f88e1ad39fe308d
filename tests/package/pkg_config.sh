#!/bin/sh
# pkg_config.sh CC PREFIX SOURCE OUT: builds SOURCE with the flags that pkg-config gives for the
# lostmotion installed under PREFIX, and runs it.
set -eu
cc=$1 prefix=$2 source=$3 out=$4
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name lostmotion.pc)")
export PKG_CONFIG_PATH
# The flags are words to be split.
# shellcheck disable=SC2046
"$cc" "$source" $(pkg-config --cflags --define-variable=prefix="$prefix" lostmotion) \
  $(pkg-config --libs --define-variable=prefix="$prefix" lostmotion) -o "$out"
"$out"
