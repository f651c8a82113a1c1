#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>

#include "engine/session/project.h"

// Strokes of `palpate touch` are kept in the project that SCENE is, or in a journal
// beside the file of -o.
namespace palpate {

struct TouchedStrokes {
    std::string scene, labels, output; // as options name them
    bool edits = false;                // --edit or --drill
    bool keep_journal = false;         // --journal

    bool in_project() const { return edits && Project::is_one(scene); }
    bool in_journal() const { return edits && !output.empty() && !in_project(); }
    std::filesystem::path journal() const { return output + ".journal"; }
};

// The project that SCENE is, opened so that strokes become its steps; nothing where it is none or
// nothing is edited.
Result<std::optional<Project::Opened>> open_project(const TouchedStrokes& strokes,
                                                    const std::stop_token& stop);

// A session on the document of a project, felt as `felt` is. The edit works on the volumes by the
// project's names.
SessionSetup setup_in_project(SessionSetup project, SessionSetup felt, EditSetup& edit);

// The journal beside -o, where strokes are kept there.
Result<std::optional<Journal>> begin_journal(const TouchedStrokes& strokes,
                                             const Document& document);

// Passes on `done`; the strokes stay if it is an error.
Result<void> end_journal(const TouchedStrokes& strokes, Result<void> done);

} // namespace palpate
