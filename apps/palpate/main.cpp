#include <string_view>

#include "apps/palpate/command.h"
#include "engine/decode/serve.h"
#include "engine/program/program.h"

namespace {

constexpr palpate::ProgramCommand kCommands[] = {
    {"batch", "Draw many pictures on one device, a line of JSON each", palpate::add_batch},
    {"compare", "Compare two pictures, meshes, volumes or label maps", palpate::add_compare},
    {"devices", "List haptic devices, and home or calibrate one", palpate::add_devices},
    {"doctor", "List what this machine offers: Vulkan devices, memory, real-time policy",
     palpate::add_doctor},
    {"info", "Describe a volume: size, spacing, orientation, type, range", palpate::add_info},
    {"edit", "Apply strokes of tools to labels or grey values", palpate::add_edit},
    {"filter", "Filter a volume: smooth, derive, combine, resample", palpate::add_filter},
    {"convert", "Read a volume in any format and write it in another", palpate::add_convert},
    {"bench", "Measure speed beside error", palpate::add_bench},
    {"measure", "Measure lengths, angles, areas, balls and labels", palpate::add_measure},
    {"project", "Create, describe and change a project folder", palpate::add_project},
    {"render", "Draw a scene or a volume to a picture", palpate::add_render},
    {"seeds", "Place seeds in known objects as a person would, for trials", palpate::add_seeds},
    {"segment", "Find objects from seeds: fast marching, region growing and others",
     palpate::add_segment},
    {"surface", "Extract an iso-surface, or the surfaces of labels, as a mesh",
     palpate::add_surface},
    {"touch", "Run the haptic loop with a simulated hand and device", palpate::add_touch},
    {"view", "Open a window with slices and 3D, and edit by hand", palpate::add_view},
};

} // namespace

int main(int argc, char** argv) {
    if (argc > 1 && std::string_view(argv[1]) == "__decode") // a child of load_volume()
        palpate::io::serve_decoding(argc, argv);
    return palpate::run_program(argc, argv, kCommands);
}
