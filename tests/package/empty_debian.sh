#!/usr/bin/env bash
# The packages in an empty Debian 12 of their own, made by mmdebstrap from this machine's package mirror: the
# Debian packages install, and the program and the Python module run; then, all that purged, the wheel in a
# virtual environment, and the archive. Needs root, mmdebstrap and the mirror; without, it says so and exits
# with 77.
#
#   empty_debian.sh CHECKOUT BUILD WORK
set -euo pipefail
checkout=$1 build=$2 work=$3
root=$work/root

skip() { echo "empty_debian: skipped: $1"; exit 77; }
[[ $(id -u) -eq 0 ]] || skip "needs root, to make a Debian of its own"
command -v mmdebstrap > /dev/null || skip "needs mmdebstrap (apt-get install mmdebstrap)"
[[ $(. /etc/os-release && echo "$VERSION_CODENAME") == bookworm ]] || skip "needs Debian 12, whose packages these are"

rm -rf "$work"
mkdir -p "$work"
trap 'rm -rf "$work"' EXIT
timeout 200 mmdebstrap --variant=apt --mode=root --quiet bookworm "$root" > "$work/said" 2>&1 ||
    skip "no Debian could be made: $(tail -1 "$work/said")"

within() { unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" \
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
# Where it fails, all that was said is shown.
quiet() { "$@" > "$work/said" 2>&1 || { cat "$work/said" >&2; exit 1; }; }

(cd "$build" && quiet cpack -G DEB -B "$work/packages" && quiet cpack -G TGZ -B "$work/packages")
quiet "$checkout/scripts/wheel" "$build" "$work/packages"
mkdir "$root/packages"
cp "$work"/packages/*.deb "$work"/packages/*.whl "$work"/packages/*.tar.gz "$root/packages"

quiet within apt-get update
# The smallest driver that draws without a graphics card is recommended by the package, not required.
quiet within sh -c 'apt-get install -y --no-install-recommends mesa-vulkan-drivers /packages/palpate_*.deb \
    /packages/palpate-bench_*.deb /packages/python3-palpate_*.deb'
within palpate render 'synthetic:phantom?size=48' --iso 300 --size 64,64 -o /packages/deb.png
within palpate convert 'synthetic:phantom?size=48' /packages/v.nii.gz
within palpate bench --help > /dev/null
# A foreign file is decoded by the program that was installed.
within sh -c 'cd /packages && python3 -c "
import palpate
assert palpate.decoder_program() == \"/usr/bin/palpate\", palpate.decoder_program()
palpate.render(palpate.load(\"v.nii.gz\"), iso=300, size=(64, 64)).save(\"python.png\")"'
cmp "$root/packages/deb.png" "$root/packages/python.png"
echo "empty_debian: the Debian packages install and run"

quiet within sh -c 'apt-get purge -y palpate palpate-bench python3-palpate && apt-get autoremove -y --purge &&
    apt-get install -y --no-install-recommends mesa-vulkan-drivers python3-venv python3-numpy'
! within sh -c 'command -v palpate' || { echo "empty_debian: purging left a program" >&2; exit 1; }
quiet within sh -c 'python3 -m venv --system-site-packages /venv &&
    /venv/bin/pip install --no-index --no-deps /packages/palpate-*.whl'
within sh -c 'cd /packages && /venv/bin/python -c "
import palpate
assert palpate.decoder_program().startswith(\"/venv/\"), palpate.decoder_program()
palpate.render(palpate.load(\"v.nii.gz\"), iso=300, size=(64, 64)).save(\"wheel.png\")"'
cmp "$root/packages/deb.png" "$root/packages/wheel.png"
echo "empty_debian: the wheel runs in a virtual environment"

quiet within sh -c 'apt-get purge -y python3-numpy python3-venv && apt-get autoremove -y --purge &&
    mkdir /opt/palpate && tar -xzf /packages/palpate-*.tar.gz -C /opt/palpate --strip-components=1 &&
    apt-get install -y --no-install-recommends mesa-vulkan-drivers'
within /opt/palpate/bin/palpate render /packages/v.nii.gz --iso 300 --size 64,64 -o /packages/archive.png
cmp "$root/packages/deb.png" "$root/packages/archive.png"
echo "empty_debian: the archive runs"
