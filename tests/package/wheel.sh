#!/usr/bin/env bash
# The wheel of scripts/wheel works in a fresh virtual environment, with its own program and libraries; NumPy is the
# machine's, so that nothing is downloaded.
#
#   wheel.sh CHECKOUT BUILD WORK
set -euo pipefail
checkout=$1 build=$2 work=$3
rm -rf "$work"
mkdir -p "$work/elsewhere"
"$checkout/scripts/wheel" "$build" "$work/dist" > /dev/null
/usr/bin/python3 -m venv --system-site-packages "$work/venv"
"$work/venv/bin/pip" install -q --no-index --no-deps --disable-pip-version-check "$work"/dist/palpate-*.whl
cd "$work/elsewhere"
unset PYTHONPATH LD_LIBRARY_PATH PALPATE_DECODER
PATH=/usr/bin:/bin "$work/venv/bin/python" - "$work/venv" << 'PY'
import re, subprocess, sys
import palpate
site = palpate.__file__.rsplit("/", 1)[0]
assert site.startswith(sys.argv[1]), site
assert palpate.decoder_program() == f"{site}/bin/palpate", palpate.decoder_program()
volume = palpate.load("synthetic:phantom?size=32")
palpate.save("v.nii.gz", volume)
assert (palpate.load("v.nii.gz").to_numpy() == volume.to_numpy()).all()  # by the wheel's program
assert palpate.render(volume, size=(32, 32)).to_numpy().shape == (32, 32, 3)
# Of the machine's libraries it takes those of the compiler and of glibc, and no other.
for binary in (palpate._core.__file__, f"{site}/bin/palpate"):
    lines = subprocess.run(["ldd", binary], capture_output=True, text=True, check=True).stdout.splitlines()
    own = [line for line in lines if f"=> {site}/" in line]
    other = [line for line in lines if " => " in line and line not in own]
    known = re.compile(r"\s*(libc|libm|libdl|librt|libpthread|libmvec|libgcc_s|libstdc\+\+)\.so")
    assert len(own) >= 8, lines
    assert all(known.match(line) for line in other), other
PY
rm -rf "$work"
