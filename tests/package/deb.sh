#!/usr/bin/env bash
# The Debian packages hold what they say, name libraries that this Debian has, and run from a folder where they
# are unpacked. Installing them into an empty Debian needs a network: `apt-get install ./*.deb` there.
#
#   deb.sh BUILD WORK
set -euo pipefail
build=$1 work=$2
rm -rf "$work"
mkdir -p "$work/root" "$work/elsewhere"
cd "$build"
cpack -G DEB -B "$work/debs" > "$work/said" 2>&1 || { cat "$work/said" >&2; exit 1; }
cd "$work/elsewhere"
for package in palpate palpate-bench python3-palpate libpalpate-dev; do
    deb=$(ls "$work"/debs/"$package"_*.deb)
    dpkg-deb -x "$deb" "$work/root"
    dpkg-deb -f "$deb" Depends > "$work/$package.depends"
done
grep -q 'libvulkan1' "$work/palpate.depends"
grep -q 'libstdc++6 (>= ' "$work/palpate.depends"
grep -q 'palpate (= ' "$work/python3-palpate.depends"
# Every package named is one that this Debian knows.
for name in $(cat "$work"/*.depends | tr ',' '\n' | sed 's/(.*//; s/|.*//; s/ //g' | sort -u); do
    case $name in palpate) continue ;; esac
    dpkg-query -W "$name" > /dev/null 2>&1 || apt-cache show "$name" > /dev/null 2>&1 ||
        { echo "deb: no such package in this Debian: $name" >&2; exit 1; }
done
root=$work/root/usr
for file in share/man/man1/palpate-render.1 share/bash-completion/completions/palpate share/doc/palpate/LICENSE share/doc/palpate/linked.txt \
    share/applications/palpate.desktop lib/cmake/palpate/palpate-config.cmake \
    share/palpate/udev/70-palpate.rules lib/python3/dist-packages/palpate/py.typed; do
    [[ -e $root/$file || -e $root/$file.gz ]] || { echo "deb: expected $file" >&2; exit 1; }
done
# The list names every package that the program depends on but the Vulkan loader, which is opened by name.
for name in $(tr ',' '\n' < "$work/palpate.depends" | sed 's/(.*//; s/|.*//; s/ //g' | grep -v libvulkan1); do
    # A package may stand for another name, as libspdlog1.10 does for libspdlog1.10-fmt9.
    owner=$(dpkg-query -W -f='${Package} ${Provides}\n' | awk -v n="$name" '{ gsub(",", " ") }
        $1 == n || (" " $0 " ") ~ (" " n " ") { if (!found++) print $1 }')
    grep -q " ${owner:-$name} " "$root/share/doc/palpate/linked.txt" ||
        { echo "deb: $name is not in the list of linked libraries" >&2; exit 1; }
done
unset PYTHONPATH LD_LIBRARY_PATH PALPATE_DECODER
"$root/bin/palpate" render 'synthetic:ball?size=16' --size 16,16 -o ball.png
"$root/bin/palpate" bench --help > /dev/null
PYTHONPATH=$root/lib/python3/dist-packages /usr/bin/python3 - "$root" << 'PY'
import sys
import palpate
assert palpate.decoder_program() == f"{sys.argv[1]}/bin/palpate", palpate.decoder_program()
palpate.render("synthetic:ball?size=16", size=(16, 16)).save("python.png")
assert open("python.png", "rb").read() == open("ball.png", "rb").read()
PY
rm -rf "$work"
