#!/usr/bin/env python3
"""Whether the tests find faults: 24 small faults in all libraries, each put in at run time.

mutants.py FOLDER [NUMBER ...]   (default: all)

Copies the sources to FOLDER, writes `right` as `mutated(number, right, wrong)` there, builds once (FOLDER/build/dev, preset
`together`; objects without a fault are those of a compiler cache where there is one), and for each fault runs the quick
tests of the libraries that reach it with PALPATE_MUTANT=number, until one fails. A fault is found where a test fails that
passes without it. Exit code 1 where a fault is not found, or where a test fails without any fault."""

import os
import shutil
import subprocess
import sys

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

HEADER = """#pragma once
#ifdef __cplusplus
#include <cstdlib>
inline int palpate_mutant() {
    static const int number = std::getenv("PALPATE_MUTANT") ? std::atoi(std::getenv("PALPATE_MUTANT")) : 0;
    return number;
}
template <class T>
inline T mutated(int number, T right, T wrong) { return palpate_mutant() == number ? wrong : right; }
#endif
"""

HEADER_NAME = "tests/mutants/mutated.h"

# File, what stands there once, what stands there instead (# is the number), the tests that reach it.
MUTANTS = [
    ("engine/base/percentile.h", "std::ceil(share * static_cast<double>(values.size()))",
     "std::ceil(share * static_cast<double>(values.size()) + mutated(#, 0.0, 1.0))", "base"),
    ("engine/volume/sample.cpp", "gradient[axis] = 0.5 *", "gradient[axis] = mutated(#, 0.5, 0.505) *", "volume"),
    ("engine/volume/changes.cpp", "differing_blocks(*was, *is)", "(differing_blocks(*was, *is) & mutated(#, ~uint64_t{0}, ~uint64_t{1}))",
     "volume|edit"),
    ("engine/image/display_byte.h", "std::lround(255.0f *", "std::lround(mutated(#, 255.0f, 254.0f) *", "image"),
    ("engine/mesh/topology.cpp", "counts.open += uses == 1;", "counts.open += uses == mutated<size_t>(#, 1, 3);", "mesh"),
    ("engine/measure/statistics.cpp", "(count - 1.0)", "(count - mutated(#, 1.0, 0.0))", "measure"),
    ("engine/surface/block_vertices.cpp", "(iso - a) / (b - a)", "(iso - a) / (b - a) * mutated(#, 1.0f, 0.99f)", "surface"),
    ("engine/edit/sweep.cpp", "std::clamp(glm::dot(p - a, d) / dd, 0.0, 1.0)",
     "std::clamp(glm::dot(p - a, d) / dd, 0.0, mutated(#, 1.0, 0.9))", "edit"),
    ("engine/segment/threshold.cpp", "v[0] <= interval.high", "v[0] < interval.high + mutated(#, 1e-3f, 0.0f)",
     "segment|segment_tables|filter|cli_segment"),
    ("engine/segment/gaussian.cpp", "{glm::ivec3(0)}, [](Arrays&) {}, true", "{glm::ivec3(mutated(#, 0, 1), 0, 0)}, [](Arrays&) {}, true",
     "filter"),
    ("engine/io/narrow.cpp", "min = std::min(min, other.min);", "min = mutated(#, std::min(min, other.min), min);", "io"),
    ("engine/decode/nifti_header.cpp", "fields.at<float>(112)", "fields.at<float>(mutated(#, 112, 116))", "io_formats"),
    ("engine/scene/camera.cpp", "view.left = middle.x - half_width;", "view.left = middle.x - mutated(#, 1.0, 1.01) * half_width;", "scene"),
    ("engine/annotate/measure.cpp", "focal_mm * (view.top - view.bottom)", "mutated(#, 1.0, 2.0) * focal_mm * (view.top - view.bottom)",
     "annotate"),
    ("engine/gpu/barrier.cpp", "if (covered)", "if (covered || mutated(#, false, true))", "gpu"),
    ("engine/render/cell_distances.cpp", "glm::min(box.high + reach, count)", "glm::min(box.high + mutated(#, reach, reach - 1), count)", "gpu"),
    ("engine/surface_gpu/range_allocator.cpp", "length += before->second;", "length += mutated(#, before->second, 0u);", "gpu|gpu_extract"),
    ("engine/reference/sampler.cpp", "std::max(to_light, 0.0)", "std::max(to_light, mutated(#, 0.0, 0.1))", "reference|gpu|gpu_light"),
    ("engine/session/kept.cpp", "if (kept.tool_radius_mm)", "if (kept.tool_radius_mm && mutated(#, true, false))", "session"),
    ("haptics/field/triangles.cpp", "const double d1 = glm::dot(ab, ap)", "const double d1 = mutated(#, 1.0, 1.05) * glm::dot(ab, ap)",
     "haptics_proxy|touch"),
    ("haptics/proxy/coupler.cpp", "output.force_n = coupling_n(feel_.stiffness_n_per_m, damping,",
     "output.force_n = coupling_n(mutated(#, 1.0, 1.1) * feel_.stiffness_n_per_m, damping,", "haptics_proxy|touch"),
    ("haptics/safety/passivity.cpp", "work_j_ += work_j;", "work_j_ += mutated(#, 1.0, 0.5) * work_j;", "haptics_safety"),
    ("haptics/device/velocity.cpp", "(newest - position(back)[axis]) / span_s", "(newest - position(back)[axis]) / span_s * mutated(#, 1.0, 0.9)",
     "haptics_device"),
    ("haptics/sound/milling.cpp", "static_cast<double>(count) * sample_mm3", "static_cast<double>(count) * mutated(#, 1.0, 2.0) * sample_mm3",
     "haptics_sound|session"),
]


def make(folder, tests):
    shutil.rmtree(folder, ignore_errors=True)
    files = subprocess.run(["git", "ls-files", "-z"], cwd=TOP, check=True, capture_output=True).stdout.split(b"\0")
    for name in filter(None, files):
        path = os.path.join(folder, name.decode())
        os.makedirs(os.path.dirname(path), exist_ok=True)
        shutil.copy2(os.path.join(TOP, name.decode()), path)
    with open(os.path.join(folder, HEADER_NAME), "w", encoding="utf-8") as file:
        file.write(HEADER)
    for number, (name, right, wrong, _) in enumerate(MUTANTS, 1):
        path = os.path.join(folder, name)
        with open(path, encoding="utf-8") as file:
            text = file.read()
        if text.count(right) != 1:
            sys.exit(f"mutants: {name}: expected '{right}' once, found {text.count(right)} times")
        first = text.index("#include")
        text = text[:first] + f'#include "{HEADER_NAME}"\n' + text[first:]
        with open(path, "w", encoding="utf-8") as file:
            file.write(text.replace(right, wrong.replace("#", str(number))))
    build = os.path.join(folder, "build", "dev")
    subprocess.run(["cmake", "--preset", "together", f"-DPALPATE_SHARED_DATA={os.path.join(TOP, '..', 'shared', 'data')}"],
                   cwd=folder, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", build, "--target", *(f"test_{name}" for name in tests)], check=True)
    return build


def failed(build, tests, number, first_only):
    """The names of the tests that fail."""
    environment = dict(os.environ, PALPATE_MUTANT=str(number))
    more = ["--stop-on-failure"] if first_only else []
    said = subprocess.run(["ctest", "--test-dir", build, "--parallel", str(os.cpu_count()), "--no-tests=error", "--label-regex", "^quick$",
                           "--tests-regex", f"^({'|'.join(tests)})/", *more], env=environment, capture_output=True, text=True,
                          check=False)
    if "No tests were found" in said.stderr:
        sys.exit(f"mutants: expected tests of {tests}, found none")
    after = said.stdout.split("The following tests FAILED:")
    return [line.split(" - ")[1].split(" (")[0] for line in after[1].splitlines() if " - " in line] if len(after) > 1 else []


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    numbers = [int(n) for n in sys.argv[2:]] or range(1, len(MUTANTS) + 1)
    all_tests = sorted({t for n in numbers for t in MUTANTS[n - 1][3].split("|")})
    build = make(os.path.abspath(sys.argv[1]), all_tests)
    already = set(failed(build, all_tests, 0, False))
    missed = []
    for number in numbers:
        name, right, _, tests = MUTANTS[number - 1]
        found = sorted(set(failed(build, tests.split("|"), number, not already)) - already)
        print(f"{number:2d} {name}: {right}: {'found by ' + ', '.join(found[:4]) if found else 'NOT FOUND'}", flush=True)
        if not found:
            missed.append(number)
    print(f"{len(numbers) - len(missed)} of {len(numbers)} faults found; fail without a fault: {', '.join(sorted(already)) or 'none'}")
    sys.exit(bool(missed or already))


if __name__ == "__main__":
    main()
