#!/usr/bin/env bash
# check.sh CASE FOLDER ROOT GLSLANG EMBED_SPIRV COMPILER
# A shader that C++ would misunderstand ends the build with a sentence. Exit 0 where it does.
set -euo pipefail
case=$1 out=$2/wrong_$1 root=$3 glslang=$4 embed=$5 compiler=$6
source=$root/tests/gpu/wrong_shaders/$case.comp
mkdir -p "$out"
"$glslang" --quiet -V --target-env vulkan1.3 -I"$root" -o "$out/${case}_0.spv" "$source"
build() {
    "$embed" "$source" "$root" "$out" "$case" &&
        "$compiler" -std=c++20 -fsyntax-only -I"$root" -DGLM_FORCE_XYZW_ONLY -DGLM_FORCE_EXPLICIT_CTOR "$out/$case.cpp"
}
if said=$(build 2>&1); then
    echo "expected a failure, found a build"
    exit 1
fi
expected=$(sed -n 's|^// expected: ||p' "$source")
grep -F -- "$expected" <<< "$said" || { echo "expected: $expected"; echo "found: $said"; exit 1; }
