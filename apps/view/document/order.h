#pragma once

#include <glm/glm.hpp>
#include <string>
#include <variant>

#include "engine/program/mesh_export.h"

// Orders: work that a change of the state cannot do. Widgets, keys and tools of the window give
// them, each with exactly what it needs.
namespace palpate::view {

struct LabelChange;

namespace order {

struct Bare { // an order that needs nothing more
    bool operator==(const Bare&) const = default;
};

// Strokes of the tool of the left button.
struct StrokeDown {
    glm::dvec3 at_mm{0.0};
    double time_s = 0.0;
    glm::dvec3 disc_across{0.0}; // the direction across a disc; 0: the brush is a ball
    bool operator==(const StrokeDown&) const = default;
};
struct StrokeMove {
    glm::dvec3 at_mm{0.0};
    double time_s = 0.0;
    bool operator==(const StrokeMove&) const = default;
};
struct StrokeUp {
    glm::dvec3 at_mm{0.0};
    double time_s = 0.0;
    bool operator==(const StrokeUp&) const = default;
};
struct StrokeCancel {
    double time_s = 0.0;
    bool operator==(const StrokeCancel&) const = default;
};

struct Undo : Bare {};
struct Redo : Bare {};
struct Save {
    std::string folder{}; // of a new project; empty: the one that is open
    bool operator==(const Save&) const = default;
};
struct ExportMeasures {
    std::string path{};
    bool operator==(const ExportMeasures&) const = default;
};
struct ExportLabels { // all of them, or the surface of the one that is drawn
    std::string path{};
    bool each = false; // the surfaces of all, each in a file of its own
    bool operator==(const ExportLabels&) const = default;
};
struct ExportMesh { // a surface for print
    MeshExport made;
    std::string path{};
    bool operator==(const ExportMesh&) const = default;
};
struct StopMesh : Bare {};
struct Tell { // a person
    std::string words{};
    bool operator==(const Tell&) const = default;
};

struct Segment : Bare {};
struct StopSegmenting : Bare {};
struct Bound : Bare {}; // the last result's objects anew, by Segmenting::preview
struct ClearSeeds : Bare {};
struct FillWire : Bare {}; // the contour that was closed, with the label that is drawn

struct StartHand {
    std::string device{}; // empty: the last one
    bool operator==(const StartHand&) const = default;
};
struct StopHand : Bare {};
struct ArmHand : Bare {};
struct DisarmHand : Bare {};
struct ResetRemoved : Bare {}; // material that tools have taken away counts from here

// The label that is drawn changes as a whole, or becomes a mesh that is pulled and becomes the
// label again.
struct ChangeLabel {
    const LabelChange* change = nullptr; // of label_changes()
    bool operator==(const ChangeLabel&) const = default;
};
struct MakeMesh : Bare {};
struct ApplyMesh : Bare {};
struct DropMesh : Bare {}; // or what makes it
struct PullDown {
    glm::dvec3 at_mm{0.0};
    bool operator==(const PullDown&) const = default;
};
struct PullMove {
    glm::dvec3 at_mm{0.0};
    bool operator==(const PullMove&) const = default;
};
struct PullUp : Bare {};
struct PullCancel : Bare {};

struct Open {
    std::string path{}, series{};
    bool operator==(const Open&) const = default;
};
struct OpenLabels { // of a file, in the place of those that are there
    std::string path{};
    bool operator==(const OpenLabels&) const = default;
};
struct OpenFused { // another volume, in colour over the slices
    std::string path{};
    bool operator==(const OpenFused&) const = default;
};
struct OpenRead : Bare {}; // the label map about which a person was asked, by itself
struct OpenLast : Bare {}; // the document that was opened before this one
struct CancelOpening : Bare {};
struct Close : Bare {};
struct Leave : Bare {};       // what waits is done, and edits that are not saved are lost
struct TakePicture : Bare {}; // of the window, to a file
struct PrintFigure {          // of a view
    std::string path{};
    bool operator==(const PrintFigure&) const = default;
};
struct StopFigure : Bare {};

// Recording of input, and playing it again: of a window.
struct RecordScript {
    std::string path{};
    bool operator==(const RecordScript&) const = default;
};
struct PlayScript {
    std::string path{};
    double speed = 1.0; // times as fast as it was recorded
    bool operator==(const PlayScript&) const = default;
};
struct StopScript : Bare {}; // the recording

} // namespace order

// Those that the document obeys.
using DocumentOrder = std::variant<
    order::StrokeDown, order::StrokeMove, order::StrokeUp, order::StrokeCancel, order::Undo,
    order::Redo, order::Save, order::ExportMeasures, order::ExportLabels, order::ExportMesh,
    order::StopMesh, order::Tell, order::Segment, order::StopSegmenting, order::Bound,
    order::ClearSeeds, order::FillWire, order::StartHand, order::StopHand, order::ArmHand,
    order::DisarmHand, order::ResetRemoved, order::ChangeLabel, order::MakeMesh, order::ApplyMesh,
    order::DropMesh, order::PullDown, order::PullMove, order::PullUp, order::PullCancel>;

// All: the window obeys the others itself, and asks where to before it passes on a save.
using Order =
    std::variant<order::Open, order::OpenRead, order::OpenLast, order::OpenLabels, order::OpenFused,
                 order::CancelOpening, order::Close, order::Leave, order::TakePicture,
                 order::PrintFigure, order::StopFigure, order::RecordScript, order::PlayScript,
                 order::StopScript, order::Save, DocumentOrder>;
using ScriptOrder = std::variant<order::RecordScript, order::PlayScript, order::StopScript>;

// For a person, of one that failed: "undo".
const char* name_of(const Order& order);

// One function of several, by the type of its argument: for std::visit.
template <class... Function>
struct Overloaded : Function... {
    using Function::operator()...;
};
template <class... Function>
Overloaded(Function...) -> Overloaded<Function...>;

} // namespace palpate::view
