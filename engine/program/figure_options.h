#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/annotate/figure.h"
#include "engine/program/open_scene.h"

namespace CLI {
class App;
}

namespace palpate {

// Options of `palpate render` for figures: marks over the picture.
struct FigureOptions {
    std::vector<std::string> marks; // names of FigureMark; "all"
    double text_px = 0.0;

    bool has(const std::string& mark) const;
};
void add_figure_options(CLI::App& app, FigureOptions& options);

// The marks of a scene's picture. `transparent`: the background is. `moves`: it is one of a movie.
Figure figure_of(const FigureOptions& options, const OpenedScene& opened, bool transparent,
                 bool moves);

// The labels that a scene shows with their colours, the one that covers most first: in slices of
// the pixels, else of the samples. Named by the label map, else "label 7". Hidden ones are left
// out.
std::vector<LegendEntry> legend_of(const Scene& scene, const Volume& labels,
                                   std::span<const LabelName> names);
std::vector<LegendEntry> legend_of(const Scene& scene, const LoadedScene& loaded);

// Moves a lone slice to the right, smaller where it must be, so that its legend lies beside it. Not
// where the person chose the camera, or where the legend takes more than half of the picture.
void make_room_for_legend(const FigureOptions& options, const SceneOptions& chosen,
                          OpenedScene& opened);

// A sentence where a mark that was asked for has nothing to show; else empty.
std::string idle_mark(const FigureOptions& options, const OpenedScene& opened);

} // namespace palpate
