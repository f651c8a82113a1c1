#pragma once

#include <optional>
#include <string>
#include <utility>

#include "apps/view/document/open_document.h"

namespace palpate::view {

// Keeps a document in a project: the one that was opened, or a new one. The steps of a document
// without a project are in its steps file until a new project has them.
class Saving {
 public:
    Saving(OpenDocument& document, std::optional<Project::Opened> opened);

    // Saves in the background, to the project that is open or to a new one in `folder`, with the
    // state's camera and window. Without a project and a folder it does nothing.
    void save(const ViewState& state, const std::string& folder);
    void poll(); // for each frame: what became of a save, and autosaves

    bool has_project() const { return project_.has_value(); }
    bool is_saving() const;
    // "saved to FOLDER", of the project that is open; empty without one.
    Message saved_text() const;
    // Whether steps are lost that no project has. What cuts and colours the view alone is no loss.
    bool leaving_loses_steps();
    // The folder of a project that a save has made: once.
    std::string take_new_project() { return std::exchange(new_project_, {}); }
    // A save to a new project that failed, and why: once.
    struct FailedSave {
        std::string folder;
        Message reason;
    };
    std::optional<FailedSave> take_failed_save() {
        return std::exchange(failed_save_, std::nullopt);
    }

    // The folder that a new project is offered, one that is not there: named after the file, or,
    // where names are hidden, not.
    std::string new_folder(bool names_hidden) const;

 private:
    void take(Project project);
    void fail_save(std::string folder, Message reason);

    OpenDocument& document_;
    const Document opened_;        // with the steps that came back
    const std::string new_folder_; // named after the file
    std::string new_project_;
    std::optional<Project> project_;
    std::optional<Project::Creation> creation_;
    std::string creating_; // the folder of creation_
    std::optional<FailedSave> failed_save_;
};

// Maps that a person may draw on are no edits: a project that lacks them gets empty ones, where it
// has no unsaved steps.
Result<void> add_maps(Project::Opened& project);

} // namespace palpate::view
