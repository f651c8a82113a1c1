#!/usr/bin/env bash
# The README's two commands in a Debian 13 of their own, made by mmdebstrap: scripts/demo and scripts/test, which install
# packages, build and run the quick tests (and those on real data, where it lies beside the checkout). Hours. Needs root,
# mmdebstrap and a package mirror; without, it says so and exits with 77.
#
#   debian_13.sh CHECKOUT WORK
set -euo pipefail
checkout=$1 work=$2
root=$work/root

skip() { echo "debian_13: skipped: $1"; exit 77; }
[[ $(id -u) -eq 0 ]] || skip "needs root, to make a Debian of its own"
command -v mmdebstrap > /dev/null || skip "needs mmdebstrap (apt-get install mmdebstrap)"

rm -rf "$work"
mkdir -p "$work"
trap 'rm -rf "$work"' EXIT
timeout 900 mmdebstrap --variant=apt --mode=root --quiet --include=ca-certificates trixie "$root" > "$work/said" 2>&1 ||
    skip "no Debian could be made: $(tail -1 "$work/said")"

# A session of its own, with /proc, /dev and shared memory and without the outer system's variables. What mounts is the
# outer system's: the small Debian has no mount.
export root
within() { unshare --mount --pid --fork --mount-proc="$root/proc" \
    sh -c 'mkdir -p "$root/dev/shm" && mount -t tmpfs tmpfs "$root/dev/shm" && exec chroot "$root" /usr/bin/env -i "$@"' \
    sh PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }

mkdir "$root/palpate"
git -C "$checkout" archive HEAD | tar -x -C "$root/palpate"
within git --version > /dev/null 2>&1 || within apt-get -qq update # bootstrap installs the rest
if [[ -d $checkout/../shared/data ]]; then
    mkdir "$root/shared"
    cp -r "$checkout/../shared/data" "$root/shared/data"
fi
within /palpate/scripts/demo
test -s "$root/palpate/out/demo/ct_iso.png"
within /palpate/scripts/test
