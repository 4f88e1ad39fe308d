#!/bin/sh
# unity_from_debian.sh DIR: extracts unity.c and its two headers from a Debian package into DIR.
# Installs nothing, needs no root, and does not change apt's own lists. The mirror is
# the one that this machine's apt uses; apt checks the archive's signature.
set -eu

command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null || exit 1
. /etc/os-release
out=$1
work=$out/apt
mkdir -p "$work/lists/partial" "$work/cache/archives/partial"
cd "$work"

# Copies src/unity.[ch] and unity_internals.h from the folder below this one that contains unity.c.
keep() {
  found=$(find "$work" -path '*unity*' -name unity.c | head -n 1)
  [ -n "$found" ] || return 1
  dir=$(dirname "$found")
  cp "$dir/unity.c" "$dir/unity.h" "$dir/unity_internals.h" "$out/"
  cd "$out"
  rm -rf "$work"
  echo "-- Unity taken from the package $1"
  exit 0
}

# apt with a package list of ours: private_apt LIST ARGUMENT...
private_apt() {
  list=$1
  shift
  apt-get -qq -o Dir::State::lists="$work/lists" -o Dir::Cache="$work/cache" \
    -o Dir::Etc::sourcelist="$work/$list" -o Dir::Etc::sourceparts=- \
    -o APT::Sandbox::User="$(id -un)" -o Acquire::Languages=none \
    -o Acquire::IndexTargets::deb::DEP-11::DefaultEnabled=false "$@"
}

# cmock, from this machine's own package lists.
if apt-get -qq download cmock 2>/dev/null && dpkg-deb -x cmock_*.deb cmock; then
  keep cmock
fi

mirror=$(apt-get indextargets --format '$(REPO_URI) $(RELEASE)' 'Created-By: Packages' |
  awk -v suite="${VERSION_CODENAME:-}" '$2 == suite {print $1; exit}')
[ -n "$mirror" ] || exit 1
signed="[signed-by=/usr/share/keyrings/$ID-archive-keyring.gpg]"

# cmock is in Debian from trixie on; the package is the same on every architecture and release.
if [ "$ID" = debian ]; then
  echo "deb $signed $mirror trixie main" >trixie.list
  if private_apt trixie.list update && private_apt trixie.list download cmock &&
    dpkg-deb -x cmock_*.deb cmock; then
    keep cmock
  fi
fi

# An older Unity is in the source of ntpsec.
component=main
[ "$ID" = debian ] || component=universe
echo "deb-src $signed $mirror $VERSION_CODENAME $component" >source.list
if private_apt source.list update && private_apt source.list source --download-only ntpsec &&
  tar -xf ntpsec_*.orig.tar.*; then
  keep "ntpsec (source)"
fi
exit 1
