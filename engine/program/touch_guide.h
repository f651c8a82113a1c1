#pragma once

#include <stop_token>
#include <string>

#include "engine/base/error.h"
#include "engine/session/feel.h"
#include "haptics/proxy/algorithms.h"

namespace CLI {
class App;
}

namespace palpate {

// `palpate touch --guide WHAT`: labels, edges, plane:X,Y,Z,NX,NY,NZ, or a volume of distances.
void add_guide_option(CLI::App& app, std::string& guide);

// The algorithm that a guide is felt by where none is chosen.
const char* algorithm_of_guide(const std::string& guide);

// Fails where guide and algorithm do not belong together.
Result<void> check_guide_felt(const std::string& guide, const haptics::AlgorithmEntry& algorithm);

// Whether it names a volume.
bool is_guide_file(const std::string& guide);

// Distances for the scene's first field, from what was loaded.
Result<Volume> load_guide(const std::string& guide, const Feel& feel, std::stop_token stop);

} // namespace palpate
