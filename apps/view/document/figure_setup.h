#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <utility>

#include "apps/view/document/message.h"
#include "apps/view/window/panel.h"

namespace palpate::view {

enum class Paper { black, white, transparent }; // the background of a figure
inline constexpr std::array kPapers{std::pair("black", Paper::black),
                                    std::pair("white", Paper::white),
                                    std::pair("transparent", Paper::transparent)};

// A picture of one view for print: its own size, and marks drawn at that size.
struct FigureSetup {
    static constexpr int kMost_px = 8192; // each way

    Panel panel = Panel::volume;
    glm::ivec2 size_px{1600, 1200}; // 16 .. kMost_px
    Paper paper = Paper::white;
    static constexpr int kMostPictures = 10'000;
    int pictures = 1;            // of 3D: of a camera that goes round once; 1: as the view is
    std::optional<double> share; // of those that are being drawn; none: none are
    Message told{};              // what has become of the last ones
    bool letters = true, scale_bar = true, color_bar = false, note = false;
    bool legend = true; // of labels, where the view shows some

    friend bool operator==(const FigureSetup&, const FigureSetup&) = default;
};

} // namespace palpate::view
