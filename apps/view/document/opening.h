#pragma once

#include <optional>

#include "apps/view/document/kept_steps.h"
#include "apps/view/window/state.h"
#include "engine/program/open_scene.h"
#include "engine/session/project.h"

namespace palpate::view {

// The document that a window opens.
struct Source {
    OpenedScene scene;
    std::optional<Project::Opened> project{}; // whose volumes the scene shows
    std::optional<KeptSteps> steps{};         // of what is no project
    std::optional<Volume> first_grey{};       // before all steps that came with it; by setup_of()
    bool fits_as_labels = false;              // numbers of labels, for the volume that was open
};

// A session's beginning; takes the project's setup and the steps out of the source. The document
// has all pages of notes: its own, and else what files say.
SessionSetup setup_of(Source& source, bool threaded);

// The data of a session that has just begun, and the state that it is first seen in.
Subject subject_of(const OpenedScene& opened, const Session& session, const Notes& notes);

// A map on which nothing is drawn yet.
Volume empty_labels(const Grid& grid);

} // namespace palpate::view
