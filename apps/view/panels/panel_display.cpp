// Sections of the side panel about how pictures are shown: slices and stereo.

#include <cmath>

#include "apps/view/panels/interface.h"
#include "apps/view/panels/widgets.h"
#include "engine/volume/extent.h"

namespace palpate::view {

void Interface::draw_slices(ViewState& state, Work& work) {
    const double layer = smallest_spacing_mm(work.subject().grid);
    if (slide("thickness", state.slab_mm, 0.0, 100.0 * layer,
              state.slab_mm > 0.0 ? "%.3g mm" : "none"))
        state.slab_mm = layer * std::round(state.slab_mm / layer);
    note("slices/thickness");
    if (state.slab_mm > 0.0) {
        choose("of it", state.slab_mode,
               {std::pair("maximum", SlabMode::maximum),
                {"mean", SlabMode::mean},
                {"minimum", SlabMode::minimum}});
        note("slices/mode");
    }
    slide("outline", state.outline_px, 0.0, 5.0, "%.0f px");
    note("slices/outline");
    if (ImGui::Button("volume over slices..")) {
        state.browser_open = true;
        state.browsing = Browsing::fused;
    }
    note("slices/open");
    const Scene& scene = work.session().scene();
    if (scene.fusion) {
        slide("fused", state.fusion_opacity, 0.0, 1.0, "%.2f");
        note("slices/fused");
    }
    if (scene.overlay) {
        slide("overlay", state.overlay_opacity, 0.0, 1.0, "%.2f");
        note("slices/overlay");
    }
}

void Interface::draw_stereo(ViewState& state) {
    StereoView& stereo = state.stereo;
    ImGui::Checkbox("both eyes", &stereo.on);
    note("stereo/on");
    if (!stereo.on) {
        state.cursor_mm.reset();
        return;
    }
    choose("layout", stereo.layout,
           {std::pair("red and cyan", StereoLayout::anaglyph),
            {"side by side", StereoLayout::side_by_side},
            {"top and bottom", StereoLayout::top_bottom},
            {"rows", StereoLayout::row_interleaved},
            {"columns", StereoLayout::column_interleaved},
            {"checkerboard", StereoLayout::checkerboard},
            {"left eye", StereoLayout::left},
            {"right eye", StereoLayout::right}});
    note("stereo/layout");
    ImGui::Checkbox("swap eyes", &stereo.swap_eyes);
    note("stereo/swap");
    ImGui::SameLine();
    ImGui::Checkbox("mirror", &stereo.mirror);
    note("stereo/mirror");
    if (stereo.profile) {
        ImGui::TextDisabled("%s", stereo.profile->name.c_str());
        return;
    }
    double percent = 100.0 * stereo.separation; // of the camera's distance
    if (slide("depth", percent, 0.2, 20.0, "%.1f %%", true))
        stereo.separation = percent / 100.0;
    note("stereo/depth");
}

} // namespace palpate::view
