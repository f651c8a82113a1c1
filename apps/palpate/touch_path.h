#pragma once

#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/grid.h"
#include "haptics/device/hand_path.h"

namespace CLI {
class App;
}

namespace palpate {

// The intended path of the hand of `palpate touch`: a file, a motion by name, or the moves of a
// person; or which file to write for a first try.
struct PathOptions {
    std::string path, trajectory, write; // one of them,
    bool live = false;                   // or none: a person moves the device
    haptics::TrajectoryShape shape;
    std::vector<double> at, direction;
};
void add_path_options(CLI::App& app, PathOptions& options);

// Fails where options contradict one another whatever the scene.
Result<void> check_together(const PathOptions& options);

// Tells where a path and a volume lie: "it stays within left .., and the volume within left ..".
std::string place_text(const haptics::HandPath& path, const Grid& grid);

// The path, about the volume's centre where no point is given; of a live device that centre. Fails
// where it lasts longer than an hour. Warns of options that leave it as it is.
Result<haptics::HandPath> hand_path(const CLI::App& app, const PathOptions& options,
                                    const Grid& grid);

} // namespace palpate
