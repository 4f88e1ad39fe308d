#!/bin/sh
# nlopt_from_debian.sh DIR: extracts NLopt's source from Debian's source package into DIR, and
# prints the folder. Installs nothing, needs no root, and does not change apt's own lists. The
# mirror is the one that this machine's apt uses; apt checks the archive's signature.
set -eu

command -v apt-get >/dev/null || exit 1
. /etc/os-release
mkdir -p "$1"
work=$(CDPATH='' cd -- "$1" && pwd)
mkdir -p "$work/lists/partial" "$work/cache/archives/partial"
cd "$work"
mirror=$(apt-get indextargets --format '$(REPO_URI) $(RELEASE)' 'Created-By: Packages' |
  awk -v suite="${VERSION_CODENAME:-}" '$2 == suite {print $1; exit}')
[ -n "$mirror" ] || exit 1
component=main
[ "$ID" = debian ] || component=universe
signed="[signed-by=/usr/share/keyrings/$ID-archive-keyring.gpg]"
echo "deb-src $signed $mirror $VERSION_CODENAME $component" >source.list
private_apt() {
  apt-get -qq -o Dir::State::lists="$work/lists" -o Dir::Cache="$work/cache" \
    -o Dir::Etc::sourcelist="$work/source.list" -o Dir::Etc::sourceparts=- \
    -o APT::Sandbox::User="$(id -un)" -o Acquire::Languages=none "$@" >&2
}
private_apt update
private_apt source --download-only nlopt
tar -xf nlopt_*.orig.tar.*
find "$work" -maxdepth 1 -name 'nlopt-*' -type d
