// R19: a picture is the same, to the bit, whether empty space is skipped or not.

#include "bench/cases/skipping.h"

#include <cmath>
#include <limits>
#include <random>

#include "bench/cases/scenes.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/extent.h"
#include "engine/volume/synthetic.h"

namespace palpate::cases {

namespace {

// Choices by chance; uniform_int_distribution differs between C++ libraries, a remainder does not.
class Chance {
 public:
    explicit Chance(uint32_t seed) : random_(seed) {}
    uint32_t below(uint32_t count) { return static_cast<uint32_t>(random_() % count); }
    bool one_in(uint32_t count) { return below(count) == 0; }
    double between(double low, double high) {
        return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
    }
    template <class T>
    T of(std::initializer_list<T> list) {
        return *(list.begin() + below(static_cast<uint32_t>(list.size())));
    }

 private:
    std::mt19937_64 random_;
};

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kTop = 1000.0; // values are 0 .. kTop or so; 0 is nothing

// Samples apart from each other, most of them first or last of a macro-cell of 4 or 8 samples, so
// that a cell that does not count its border loses them.
Volume specks(Chance& chance, const Grid& grid, ScalarType type, double share_missing) {
    VolumeEdit edit(make_volume(grid, type, [](glm::uvec3) { return 0.0; }));
    for (int i = 0; i < 40; ++i) {
        glm::uvec3 at;
        for (int axis = 0; axis < 3; ++axis) {
            const int border = static_cast<int>(4 * chance.below(grid.size[axis] / 4 + 1));
            const int beside = static_cast<int>(chance.below(3)) - 1;
            at[axis] = static_cast<uint32_t>(
                std::clamp(border + beside, 0, static_cast<int>(grid.size[axis]) - 1));
        }
        const bool missing = chance.between(0.0, 1.0) < share_missing;
        edit.set(at, missing ? kNaN : chance.between(0.1, 1.0) * kTop);
    }
    return edit.commit();
}

Grid some_grid(Chance& chance) {
    const glm::uvec3 size = chance.of<glm::uvec3>({{33, 33, 33},
                                                   {32, 32, 32},
                                                   {31, 29, 37},
                                                   {65, 2, 7},
                                                   {40, 40, 3},
                                                   {17, 41, 9},
                                                   {64, 16, 24},
                                                   {5, 4, 6},
                                                   {2, 2, 2}});
    const glm::dvec3 spacing =
        chance.of<glm::dvec3>({{1, 1, 1}, {0.5, 0.5, 3}, {0.7, 1.1, 2.9}, {0.25, 0.25, 0.25}});
    Grid grid = make_grid(size, spacing);
    if (chance.one_in(3)) { // turned, one axis mirrored
        const double a = chance.between(0.0, 3.0);
        const glm::dmat3 turn(std::cos(a), std::sin(a), 0, -std::sin(a), std::cos(a), 0, 0, 0, -1);
        for (int axis = 0; axis < 3; ++axis)
            grid.world_from_index[axis] = glm::dvec4(turn[axis] * spacing[axis], 0.0);
        grid.world_from_index[3] = glm::dvec4(7.5, -3.25, 11.0, 1.0);
    }
    return grid;
}

Volume some_volume(Chance& chance, const Grid& grid, std::string& name) {
    const glm::dvec3 size(grid.size);
    const double missing = chance.one_in(4) ? 0.3 : 0.0;
    const ScalarType type = missing > 0.0
                                ? ScalarType::f32
                                : chance.of({ScalarType::f32, ScalarType::i16, ScalarType::u16});
    const auto in_index = [&](const synthetic::Field& field) {
        return make_volume(grid, type, [&](glm::uvec3 i) { return field.value(glm::dvec3(i)); });
    };
    switch (chance.below(6)) {
        case 0:
            name = "specks";
            return specks(chance, grid, type, missing);
        case 1: {
            name = "ball";
            const double radius = chance.between(0.15, 0.45) * std::max({size.x, size.y, size.z});
            return in_index(synthetic::sphere(0.5 * (size - 1.0), radius, 0.8, kTop));
        }
        case 2: {
            name = "tilted sheet";
            return in_index(synthetic::thin_sheet(
                0.5 * (size - 1.0), {chance.between(-1, 1), 0.5, chance.between(-1, 1)}, 0.4,
                kTop));
        }
        case 3: {
            name = "gyroid";
            const synthetic::Field gyroid = synthetic::gyroid(chance.between(9.0, 30.0));
            return make_volume(grid, type, [&](glm::uvec3 i) {
                return 0.5 * kTop + kTop / 3.0 * gyroid.value(glm::dvec3(i));
            });
        }
        case 4:
            name = "nothing";
            return make_volume(grid, type, [](glm::uvec3) { return 0.0; });
        default:
            name = "steps"; // equal samples, so that cells end exactly at a knot
            return make_volume(grid, type, [](glm::uvec3 i) {
                return 250.0 * ((i.x / 8 + i.y / 8 + i.z / 8) % 4);
            });
    }
}

TransferFunction some_transfer(Chance& chance, std::string& name) {
    const auto points = [](std::initializer_list<TransferFunction::OpacityPoint> opacities,
                           double unit_mm) {
        return TransferFunction{
            {{0.0, {0.9, 0.2, 0.1}}, {500.0, {0.2, 0.8, 0.3}}, {kTop, {1, 1, 1}}},
            opacities,
            unit_mm};
    };
    const double unit = chance.of({0.5, 2.0, 20.0});
    const double c = chance.between(50.0, 950.0), w = chance.of({2.0, 10.0, 80.0});
    switch (chance.below(7)) {
        case 0:
            name = "ramp";
            return points({{0, 0}, {kTop, 0.5}}, unit);
        case 1:
            name = "above";
            return points({{c, 0}, {c + w, 0.6}}, unit);
        case 2:
            name = "band";
            return points({{c - w, 0}, {c, 0.8}, {c + w, 0}}, unit);
        case 3:
            name = "two bands";
            return points({{95, 0}, {100, 0.3}, {105, 0}, {c, 0}, {c + w, 0.9}, {c + 2 * w, 0}},
                          unit);
        case 4:
            name = "step at samples"; // 250 and 500 are values of the volume "steps"
            return points({{250, 0}, {250, 0.4}, {500, 0.4}, {500, 0}}, unit);
        case 5:
            name = "low end"; // what lies below the first point is seen
            return points({{1.0, 0.2}, {2.0, 0.0}}, unit);
        default:
            name = "nothing seen";
            return points({{0, 0}, {kTop, 0}}, unit);
    }
}

// Looks at the box from outside, from within, along borders of macro-cells or through their
// corners.
void some_camera(Chance& chance, const Grid& grid, Scene& scene, std::string& name) {
    const glm::dvec3 size(grid.size);
    const glm::dvec3 around(chance.between(-1, 1), chance.between(-1, 1), chance.between(-1, 1));
    const auto world = [&](glm::dvec3 index) { return world_point(grid, index); };
    const glm::dmat3 axes(grid.world_from_index);
    scene.camera =
        frame_volume(grid, around + glm::dvec3(1e-3), {0.1, 0.2, 1.0}, chance.between(0.3, 1.0));
    switch (chance.below(6)) {
        case 0:
            name = "outside";
            break;
        case 1:
            name = "outside, parallel";
            scene.camera.projection = Projection::orthographic;
            break;
        case 2: {
            name = "inside";
            const glm::dvec3 eye =
                glm::dvec3(chance.between(0, 1), chance.between(0, 1), chance.between(0, 1)) *
                (size - 1.0);
            scene.camera.eye_mm = world(eye);
            scene.camera.target_mm = world(eye + around + glm::dvec3(1e-3));
            scene.camera.view_angle_deg = 100.0;
            break;
        }
        case 3: { // rays at whole samples, so that they run in the borders of cells
            name = "along borders";
            const int along = static_cast<int>(chance.below(3)), up = (along + 1) % 3;
            scene.camera.projection = Projection::orthographic;
            const glm::dvec3 middle(16.5, 16.5, 16.5); // pixel centres are at whole samples from it
            glm::dvec3 behind = middle;
            behind[along] -= 64.0;
            scene.camera.eye_mm = world(behind);
            scene.camera.target_mm = world(middle);
            scene.camera.up = axes[up];
            scene.camera.view_height_mm = glm::length(axes[up]) * scene.size_px.y;
            break;
        }
        case 4: { // through corners of cells
            name = "through corners";
            scene.camera.projection = Projection::orthographic;
            const glm::dvec3 direction =
                axes * glm::dvec3(1, chance.of({1, -1}), chance.of({1, 0}));
            scene.camera.target_mm = world({8, 8, 8});
            scene.camera.eye_mm = scene.camera.target_mm - 40.0 * direction;
            scene.camera.up = axes[2] + 0.01 * axes[0];
            scene.camera.view_height_mm = 16.0 * glm::length(axes[1]);
            break;
        }
        default:
            name = "far away";
            scene.camera.projection = Projection::orthographic;
            scene.camera.eye_mm =
                scene.camera.target_mm +
                2e3 * glm::normalize(scene.camera.eye_mm - scene.camera.target_mm);
    }
}

void some_layer(Chance& chance, const Grid& grid, RayCastLayer& layer, std::string& name) {
    layer.step_mm = smallest_spacing_mm(grid) * chance.of({0.0, 0.3, 1.0, 2.7, 9.0});
    layer.min_transmittance = chance.of({0.0, 1.0 / 1024, 0.05});
    std::string transfer;
    layer.transfer = some_transfer(chance, transfer);
    switch (chance.below(4)) {
        case 0:
            layer.mode = RayMode::mip;
            name = "mip";
            break;
        case 1:
            layer.mode = RayMode::iso;
            name = "iso";
            layer.isos = {{chance.of({0.0, 100.0, 250.0, 500.0, 777.7, 2000.0}),
                           {1, 0.5, 0},
                           chance.of({0.3, 1.0})}};
            if (chance.one_in(2))
                layer.isos.push_back(
                    {layer.isos[0].value + chance.of({0.5, 120.0}), {0, 0, 1}, 0.7});
            break;
        default: {
            const std::vector<Integrator> all = integrators();
            layer.integrator = all[chance.below(static_cast<uint32_t>(all.size()))];
            name = name_of(layer.integrator);
            if (chance.one_in(2)) {
                layer.shading = Shading{};
                name += ", shaded";
            }
        }
    }
    name += ", " + transfer;
}

} // namespace

RandomScene random_scene(uint32_t seed) {
    Chance chance(seed);
    RandomScene made{
        {}, {}, {make_volume(Grid{}, ScalarType::u8, [](glm::uvec3) { return 0.0; }), {}}};
    Scene& scene = made.scene;
    const Grid grid = some_grid(chance);
    std::string volume, camera, layer, more;
    made.data.volume = some_volume(chance, grid, volume);
    scene.size_px = {24, 24};
    scene.background = {0.1, 0.2, 0.3};
    scene.value_and_depth = !chance.one_in(3);
    scene.ray_cast = RayCastLayer{};
    some_layer(chance, grid, *scene.ray_cast, layer);
    some_camera(chance, grid, scene, camera);
    const auto inside = [&] {
        return world_point(
            grid, glm::dvec3(chance.between(0, 1), chance.between(0, 1), chance.between(0, 1)) *
                      (glm::dvec3(grid.size) - 1.0));
    };
    const auto normal = [&] {
        return glm::dvec3(chance.between(-1, 1), chance.between(-1, 1), chance.between(0.1, 1));
    };
    for (uint32_t i = chance.one_in(3) ? 1 + chance.below(2) : 0; i > 0; --i) {
        scene.clip_planes.push_back({inside(), normal()});
        more += ", clipped";
    }
    if (chance.one_in(5)) {
        scene.slices.push_back({inside(), normal()});
        scene.slice_transfer = window_function(0.0, kTop, 1.0);
        more += ", slice";
    }
    if (chance.one_in(4)) {
        const glm::uvec3 coarse = (grid.size + 2u) / 3u;
        Grid label_grid = grid;
        label_grid.size = coarse;
        for (int axis = 0; axis < 3; ++axis)
            label_grid.world_from_index[axis] *= 3.0;
        made.data.labels = make_volume(label_grid, ScalarType::u8, [](glm::uvec3 i) {
            return static_cast<double>((i.x + 2 * i.y + i.z) % 4);
        });
        scene.labels = LabelLayer{};
        scene.labels->styles = {{}, {{1, 0, 0}, true}, {{0, 1, 0}, false}, {{0, 0, 1}, true}};
        more += ", labels";
    }
    if (chance.one_in(6)) {
        scene.stereo = StereoSettings{};
        scene.stereo->rig = {5.0, 80.0};
        more += ", stereo";
    }
    made.name = fmt::format("seed {}: {} of {}x{}x{}, {}, {}{}", seed, volume, grid.size.x,
                            grid.size.y, grid.size.z, camera, layer, more);
    return made;
}

void skipping_changes_nothing(Painter& painter, Findings& findings, uint32_t first,
                              uint32_t count) {
    findings.part("change of the picture when empty space is skipped");
    uint32_t visible = 0;
    for (uint32_t seed = first; seed < first + count; ++seed) {
        const RandomScene made = random_scene(seed);
        findings.in(made.name);
        const Image plain = painter.draw(made.scene, made.data, {.skipping = false});
        const Image skipped = painter.draw(made.scene, made.data, {.skipping = true});
        findings.within(largest_difference(plain, skipped), 0.0);
        bool any = false;
        for (size_t i = 3; i < plain.samples.size(); i += plain.channels.size())
            any = any || plain.samples[i] > 0.0f;
        visible += any ? 1 : 0;
    }
    findings.expect(3 * visible > count, "something to be seen in a third of the scenes");
}

void space_skipping(Painter& painter, Findings& findings) {
    skipping_changes_nothing(painter, findings, 0, 40);

    // Matter put where there was none, and taken away again, while everything else is kept.
    findings.part("change of the picture after an edit");
    Chance chance(1);
    const Grid grid = make_grid({41, 37, 33}, {1, 1, 1});
    Volume volume = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 0.0; });
    Scene scene;
    scene.size_px = {48, 48};
    scene.camera = frame_volume(grid, {-0.5, -1.0, 0.4}, {0, 0, 1});
    scene.ray_cast = RayCastLayer{};
    scene.ray_cast->transfer = {{{0.0, glm::dvec3(1.0)}}, {{100.0, 0.0}, {200.0, 0.6}}, 1.0};
    scene.ray_cast->isos = {{300.0}};
    for (int stroke = 0; stroke < 12; ++stroke) {
        VolumeEdit edit(volume);
        const glm::uvec3 at(chance.below(41), chance.below(37), chance.below(33));
        edit.set(at, stroke % 4 == 3 ? 0.0 : kTop);
        edit.set({7 + stroke % 2, 8, 16}, stroke % 2 == 0 ? kTop : 0.0);
        volume = edit.commit();
        for (const RayMode mode : {RayMode::alpha, RayMode::mip, RayMode::iso}) {
            scene.ray_cast->mode = mode;
            findings.in(fmt::format("stroke {}, mode {}", stroke, static_cast<int>(mode)));
            const SceneData data{volume, {}};
            const Image plain = painter.draw(scene, data, {.skipping = false});
            findings.within(
                largest_difference(plain, painter.draw(scene, data, {.skipping = true})), 0.0);
        }
    }
}

} // namespace palpate::cases
