#include "apps/view/window/sections.h"

#include <algorithm>
#include <iterator>

namespace palpate::view {

namespace {

constexpr SectionEntry kSections[] = {
    {Section::window, "window", "Window", WindowTask::look, true},
    {Section::volume, "volume", "Volume in 3D", WindowTask::look, true},
    {Section::colours, "colours", "Colours and opacity", WindowTask::look, false},
    {Section::labels_shown, "labels_shown", "Labels", WindowTask::look, true},
    {Section::layout, "layout", "Views", WindowTask::look, true},
    {Section::slices, "slices", "Slices", WindowTask::look, true},
    {Section::clips, "clips", "Clip planes", WindowTask::look, false},
    {Section::stereo, "stereo", "Stereo", WindowTask::look, false},
    {Section::appearance, "appearance", "Appearance", WindowTask::look, false},
    {Section::brush, "brush", "Brush", WindowTask::segment, true},
    {Section::mask, "mask", "Mask", WindowTask::segment, false},
    {Section::labels, "labels", "Labels", WindowTask::segment, true},
    {Section::seeds, "seeds", "Seeds", WindowTask::segment, true},
    {Section::method, "method", "Method", WindowTask::segment, true},
    {Section::mesh, "mesh", "Mesh to pull", WindowTask::segment, false},
    {Section::wire, "wire", "Scissors and contours", WindowTask::segment, false},
    {Section::measures, "measures", "Measures", WindowTask::measure, true},
    {Section::hand, "hand", "Hand", WindowTask::drill, true},
    {Section::burr, "burr", "Burr and buttons", WindowTask::drill, true},
    {Section::removed, "removed", "Volume removed", WindowTask::drill, true},
    {Section::feel, "feel", "What is felt", WindowTask::drill, true},
    {Section::forces, "forces", "Forces", WindowTask::drill, true},
    {Section::files, "files", "Files", WindowTask::exporting, true},
    {Section::label_files, "label_files", "Labels and meshes", WindowTask::exporting, true},
    {Section::print, "print", "Surface for print", WindowTask::exporting, false},
    {Section::figure, "figure", "Figure", WindowTask::exporting, false},
    {Section::session, "session", "Session", WindowTask::exporting, false},
    {Section::steps, "steps", "Steps", WindowTask::exporting, true},
};
static_assert(std::size(kSections) == static_cast<size_t>(Section::steps) + 1);
static_assert(std::size(kSections) <= 32, "OpenSections has a bit for each");
static_assert([] { // entry_of() finds them by their numbers
    for (size_t i = 0; i < std::size(kSections); ++i)
        if (static_cast<size_t>(kSections[i].section) != i)
            return false;
    return true;
}());

} // namespace

const char* name_of(WindowTask task) {
    constexpr const char* names[] = {"look", "segment", "measure", "drill", "export"};
    return names[static_cast<size_t>(task)];
}

const char* title_of(WindowTask task) {
    constexpr const char* titles[] = {"Look", "Segment", "Measure", "Drill", "Export"};
    return titles[static_cast<size_t>(task)];
}

std::span<const SectionEntry> sections() {
    return kSections;
}

const SectionEntry& entry_of(Section section) {
    return kSections[static_cast<size_t>(section)];
}

const SectionEntry* find_section(std::string_view name) {
    const auto* found = std::find_if(std::begin(kSections), std::end(kSections),
                                     [&](const SectionEntry& one) { return name == one.name; });
    return found == std::end(kSections) ? nullptr : found;
}

OpenSections::OpenSections() {
    for (const SectionEntry& one : kSections)
        set(one.section, one.open_at_first);
}

} // namespace palpate::view
