#pragma once

#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/segment/task.h"
#include "engine/volume/volume.h"

// The liver study of Nystroem et al. 2008 (section 6) with simulated users.
namespace palpate::bench {

// An organ of a real CT. Parameters were chosen on phantoms and on cases that are not `held_out`.
struct StudyOrgan {
    std::string name;
    Volume volume, truth; // truth: samples that are not 0
    bool held_out = false;
};

struct StudyOptions {
    uint32_t phantoms = 52; // the first of liver_phantom(); each by every user
    uint32_t outlined = 23; // of them, by hand too, twice
    uint32_t users = 4;     // 2 or more
    uint32_t seeds = 5;     // balls a user puts in a volume
    uint32_t pulls = 10;    // at a mesh about a phantom's liver, at most
    uint32_t curves = 3;    // phantoms on which results are corrected, click by click
    uint32_t clicks = 8;    // of a curve
    std::vector<StudyOrgan> organs;
};

// A function of its options, processor times apart, which it has none of.
//
// "rows": one an approach (by hand, fast marching, a mesh about its result, the mesh pulled by
// hand, and the controls: nothing, everything, the truth eroded and dilated by a sample), with the
// print's figures beside: "precision" (mean, CV and least Jaccard of two users' results of a
// volume), "sensitivity", "specificity" of the frame and of the liver's box, "dice", distances of
// surfaces, each as median and worst over cases and users; "clicks" and "seconds". "gap": how far
// the Dice of the automatic threshold is below that of the best threshold. "curves": mean Dice
// after so many clicks, a method each. "organs": the figures of fast marching on
// real ones, and under "mesh" those of the mesh that is not pulled.
Result<Json> liver_study(const StudyOptions& options, const Task& task);

} // namespace palpate::bench
