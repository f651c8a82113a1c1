#include "apps/view/document/order.h"

#include "apps/view/document/label_changes.h"

namespace palpate::view {

const char* name_of(const Order& order) {
    const Overloaded document{
        [](const order::Undo&) { return "undo"; },
        [](const order::Redo&) { return "redo"; },
        [](const order::StrokeDown&) { return "stroke"; },
        [](const order::StrokeMove&) { return "stroke"; },
        [](const order::StrokeUp&) { return "stroke"; },
        [](const order::StrokeCancel&) { return "stroke"; },
        [](const order::Save&) { return "save"; },
        [](const order::ExportMeasures&) { return "export of measures"; },
        [](const order::ExportLabels&) { return "export of labels"; },
        [](const order::ExportMesh&) { return "export of a mesh"; },
        [](const order::StopMesh&) { return "export of a mesh"; },
        [](const order::Segment&) { return "segmentation"; },
        [](const order::StopSegmenting&) { return "segmentation"; },
        [](const order::Bound&) { return "segmentation"; },
        [](const order::ClearSeeds&) { return "clear seeds"; },
        [](const order::FillWire&) { return "live-wire"; },
        [](const order::StartHand&) { return "hand"; },
        [](const order::StopHand&) { return "hand"; },
        [](const order::ArmHand&) { return "hand"; },
        [](const order::DisarmHand&) { return "hand"; },
        [](const order::ChangeLabel& to) { return to.change ? to.change->title : "label"; },
        [](const order::MakeMesh&) { return "mesh"; },
        [](const order::ApplyMesh&) { return "mesh"; },
        [](const order::DropMesh&) { return "mesh"; },
        [](const order::PullDown&) { return "mesh"; },
        [](const order::PullMove&) { return "mesh"; },
        [](const order::PullUp&) { return "mesh"; },
        [](const order::PullCancel&) { return "mesh"; },
        [](const auto&) { return "document"; },
    };
    const Overloaded window{
        [](const order::Open&) { return "open"; },
        [](const order::OpenRead&) { return "open"; },
        [](const order::OpenLast&) { return "open"; },
        [](const order::OpenLabels&) { return "open labels"; },
        [](const order::OpenFused&) { return "open beside"; },
        [](const order::Save&) { return "save"; },
        [](const order::TakePicture&) { return "picture"; },
        [](const order::PrintFigure&) { return "figure"; },
        [](const order::StopFigure&) { return "figure"; },
        [&](const DocumentOrder& other) { return std::visit(document, other); },
        [](const auto&) { return "window"; },
    };
    return std::visit(window, order);
}

} // namespace palpate::view
