#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace palpate::view {

// A task of a person: the bar at the top has them, and the side panel shows what the chosen one
// needs, in sections that fold.
enum class WindowTask { look, segment, measure, drill, exporting };
constexpr WindowTask kTasks[] = {WindowTask::look, WindowTask::segment, WindowTask::measure,
                                 WindowTask::drill, WindowTask::exporting};
const char* name_of(WindowTask task);  // "look", "segment", "measure", "drill", "export"
const char* title_of(WindowTask task); // "Look", ...

enum class Section : uint32_t {
    window,
    volume,
    colours,
    labels_shown,
    layout,
    slices,
    clips,
    stereo,
    appearance,
    brush,
    mask,
    labels,
    seeds,
    method,
    mesh,
    wire,
    measures,
    hand,
    burr,
    removed,
    feel,
    forces,
    files,
    label_files,
    print,
    figure,
    session,
    steps
};

struct SectionEntry {
    Section section;
    const char* name;  // its head has the id "section/<name>"
    const char* title; // of its head
    WindowTask task;
    bool open_at_first;
};
// All, those of a task in the order of the panel: what is used most is above.
std::span<const SectionEntry> sections();
const SectionEntry& entry_of(Section section);
const SectionEntry* find_section(std::string_view name); // null: there is none

// Which sections are open. A value.
class OpenSections {
 public:
    OpenSections(); // as in a new window
    bool has(Section section) const { return (bits_ >> static_cast<uint32_t>(section)) & 1u; }
    void set(Section section, bool open) {
        const uint32_t bit = 1u << static_cast<uint32_t>(section);
        bits_ = open ? bits_ | bit : bits_ & ~bit;
    }

    friend bool operator==(const OpenSections&, const OpenSections&) = default;

 private:
    uint32_t bits_ = 0;
};

} // namespace palpate::view
