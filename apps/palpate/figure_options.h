#pragma once

#include <string>
#include <vector>

#include "apps/palpate/open_scene.h"
#include "engine/annotate/figure.h"

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

// A sentence where a mark that was asked for has nothing to show; else empty.
std::string idle_mark(const FigureOptions& options, const Scene& scene);

} // namespace palpate
