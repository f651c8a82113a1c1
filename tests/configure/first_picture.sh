#!/usr/bin/env bash
# The picture that scripts/demo shows first is that of the program.
#
#   first_picture.sh PALPATE PALPATE_FIRST WORK
set -euo pipefail
palpate=$1 first=$2 work=$3
rm -rf "$work"
mkdir -p "$work"
"$palpate" --quiet convert 'synthetic:phantom?size=48' "$work/phantom.nrrd"
"$palpate" --quiet render "$work/phantom.nrrd" --iso 300 --view oblique --fill 0.65 --size 512,512 \
    --background transparent -o "$work/bone.png"
"$first" "$work/phantom.nrrd" "$work/first.png"
"$palpate" --quiet compare "$work/first.png" "$work/bone.png"
