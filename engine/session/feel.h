#pragma once

#include <memory>
#include <optional>

#include "engine/io/scene_data.h"
#include "engine/session/session.h"

namespace palpate {

// The part of a scene that a hand feels, and the edit that its tool makes.
struct Feel {
    haptics::TouchScene scene;           // with values; labels are those of a label map
    haptics::TouchParameters parameters; // by what is felt: see the functions below
    std::optional<EditSetup> edit;       // what the tool does while the button is pressed
    std::shared_ptr<haptics::TouchSurface> surface{}; // of add_felt_mesh(), where it follows edits
    std::optional<EditSetup> second_edit{};           // and another while the second one is
};

// By default a hand feels a scene's values, solid from default_iso() on, and its labels. A
// volume without labels that may be a label map itself (u8, u16) stands for both.
Feel felt_by_default(const LoadedScene& loaded);

// bone_value() of a CT, as the picture's first iso-value is: above air and fat, below dense bone.
// Half of the range else.
double default_iso(const LoadedScene& loaded);

// Vidholm & Agmund: while drawing the hand feels the values, V of the paper; while the tool erases,
// erodes or dilates labels it feels those, S. So it does where labels are told how to feel.
haptics::TouchSource default_source(const Feel& feel);

// The opacities of a function as a hand feels them: in rising values, of which a step has two, one
// double apart. At most HapticTransfer::kMostPoints: points go first whose loss changes the
// function least where they are.
haptics::HapticTransfer opacity_to_touch(const TransferFunction& function);

// Adds a mesh for the algorithms that feel one; null: the surface of the felt values or labels,
// which follows them where they are edited.
void add_felt_mesh(Feel& feel, std::shared_ptr<const Mesh> mesh = nullptr);

// A session on what is felt. Its first volume, "volume", is the one that is edited, and the setup
// of the edit says so; without an edit it is the grey one.
SessionSetup session_setup(Feel& feel);

} // namespace palpate
