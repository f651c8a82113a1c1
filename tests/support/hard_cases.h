#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "engine/image/image.h"
#include "engine/scene/scene.h"

// Scenes that break careless ray casters, numbered R1 .. R23 as in the study that collected them,
// each with the answer that any correct renderer must give in fp32 or better. The fp64 twin and the
// GPU both run them all.
namespace palpate::hard_cases {

// A picture with a known answer. check() holds expectations of GoogleTest; the image has the
// channels that the scene asks for.
struct Case {
    std::string name;
    Scene scene;
    SceneData data;
    std::function<void(const Image&)> check;
};

std::vector<Case> zero_components_and_faces(); // R1
std::vector<Case> camera_inside();             // R2
std::vector<Case> grazing_an_edge();           // R3
std::vector<Case> same_slab_other_spacing();   // R6
std::vector<Case> tiny_and_huge_depth();       // R7
std::vector<Case> ten_thousand_faint();        // R8
std::vector<Case> early_termination();         // R9
std::vector<Case> partial_steps();             // R10
std::vector<Case> every_code_of_a_ramp();      // R13
std::vector<Case> one_sample_without_data();   // R16
std::vector<Case> ramp_over_bricks();          // R20

// Scenes whose pictures must agree: no channel of R, G, B, A may differ by more than
// max_difference. 0 means the same bits.
struct Same {
    std::string name;
    std::vector<std::pair<Scene, SceneData>> variants;
    double max_difference;
};

std::vector<Same> far_away_or_tiny();     // R17
std::vector<Same> bricks_at_all_phases(); // R20

} // namespace palpate::hard_cases
