#pragma once

#include <set>
#include <string>
#include <vector>

#include "engine/session/project.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/session/session_work.h"

// A project in a folder of the test, and work on it.
namespace palpate {

namespace fs = std::filesystem;

inline constexpr int kActs = 12; // of the process that is killed
// After these it saves. No undo leads beyond: who opens a project has the steps since its save.
inline bool saves_after(int n) {
    return n == 4 || n == 6 || n == 11;
}

inline ProjectContents contents() {
    ProjectContents all{head_and_organs(), "head", "organs", {}, {}};
    all.scene.volume = "head.nrrd";
    all.scene.scene.ray_cast.emplace();
    all.scene.scene.ray_cast->mode = RayMode::iso;
    all.scene.scene.ray_cast->isos = {{300.0}};
    all.scene.scene.labels.emplace();
    all.touch.iso = 0.1;
    all.touch.stiffness_n_per_m = 321.0;
    all.touch.source = haptics::TouchSource::labels;
    all.touch.transfer[1] = {.strength_n = 0.3, .point_count = 2, .values = {1, 2}};
    all.touch.label_count = 1;
    all.touch.labels[0] = {.label = 3, .stiffness_n_per_m = 99.0, .friction_static = 0.25};
    return all;
}

// Opens it and does acts `from` to `to`, saving after some; tells `told` how many had ended, after
// each.
inline Result<void> work(const fs::path& folder, int from, int to,
                         const std::function<void(int)>& told) {
    PALPATE_TRY(Project::Opened opened, Project::open(folder));
    opened.setup.edit.threaded = false;
    Session session(std::move(opened.setup));
    told(from);
    for (int n = from; n < to; ++n) {
        act(session, n);
        told(n + 1);
        if (saves_after(n))
            PALPATE_TRY(opened.project.save(session));
    }
    return {};
}

// The document after 0, 1, .. acts, without any project.
inline const std::vector<std::string>& expected() {
    static const std::vector<std::string> all = [] {
        Session session({.document = head_and_organs(),
                         .grey = "head",
                         .labels = "organs",
                         .scene = {},
                         .touch = {},
                         .parameters = {},
                         .mesh_iso = {},
                         .edit = {.threaded = false}});
        std::vector<std::string> states{all_of(session.state().document)};
        for (int n = 0; n < kActs; ++n) {
            act(session, n);
            states.push_back(all_of(session.state().document));
        }
        return states;
    }();
    return all;
}

class ProjectTest : public TemporaryFolder {
 protected:
    void make() const {
        fs::remove_all(file("p"));
        const Result<void> made = Project::create(file("p"), contents());
        ASSERT_TRUE(made) << made.error().message;
    }
    // At once, for one who may be killed meanwhile.
    void take_away() const {
        fs::remove_all(file("old"));
        if (fs::exists(file("p")))
            fs::rename(file("p"), file("old"));
    }
    std::string what_is_there() const {
        const Result<Project::Opened> opened = Project::open(file("p"));
        return opened ? all_of(opened->setup.document) : opened.error().message;
    }
    std::string error() const {
        const Result<Project::Opened> opened = Project::open(file("p"));
        return opened ? "" : opened.error().message;
    }
    std::set<std::string> files() const {
        std::set<std::string> names;
        for (const auto& entry : fs::directory_iterator(file("p")))
            names.insert(entry.path().filename().string());
        return names;
    }
};

} // namespace palpate
