#include "apps/palpate/default_scene.h"

#include <algorithm>
#include <cmath>

#include "engine/scene/presets.h"

namespace palpate {

namespace {

struct NamedView {
    const char* name;
    ViewDirection view;
};
// World axes point to the patient's left, posterior and superior.
constexpr NamedView kViews[] = {
    {"oblique", {{-0.45, -1.0, 0.4}, {0, 0, 1}}},
    {"front", {{0, -1, 0}, {0, 0, 1}}},
    {"back", {{0, 1, 0}, {0, 0, 1}}},
    {"left", {{1, 0, 0}, {0, 0, 1}}},
    {"right", {{-1, 0, 0}, {0, 0, 1}}},
    {"top", {{0, 0, 1}, {0, -1, 0}}},
    {"bottom", {{0, 0, -1}, {0, -1, 0}}},
};

bool is_ct(const LoadedScene& loaded) {
    return loaded.modality == "CT" ||
           (loaded.modality.empty() && loaded.data.volume.range().min < -200.0f);
}

// The values that 1 % and 99.5 % of a sample of the voxels lie below; low < high.
std::pair<double, double> usual_range(const Volume& volume) {
    const glm::uvec3 size = volume.size();
    const uint32_t stride = std::max(
        1u,
        static_cast<uint32_t>(std::cbrt(static_cast<double>(sample_count(volume.grid())) / 1e5)));
    std::vector<float> values;
    for (uint32_t z = stride / 2; z < size.z; z += stride)
        for (uint32_t y = stride / 2; y < size.y; y += stride)
            for (uint32_t x = stride / 2; x < size.x; x += stride)
                if (const float v = volume.value({x, y, z}); v == v)
                    values.push_back(v);
    if (values.empty())
        return {0.0, 1.0};
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) {
        return double{values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))]};
    };
    const double low = at(0.01), high = at(0.995);
    return {low, high > low ? high : low + 1.0};
}

} // namespace

TransferFunction fitted(const TransferFunction& function, const std::string& preset_name,
                        const LoadedScene& loaded) {
    if (preset_name != "mr")
        return function;
    const auto [low, high] = usual_range(loaded.data.volume);
    return stretched(function, low, high);
}

RayCastLayer default_ray_cast(RayMode mode, const LoadedScene& loaded) {
    RayCastLayer layer;
    layer.mode = mode;
    const bool ct = is_ct(loaded);
    const auto [low, high] = usual_range(loaded.data.volume);
    if (mode == RayMode::mip)
        layer.transfer =
            ct ? window_function(-200.0, 2000.0, 1.0) : window_function(low, high, 1.0);
    else
        layer.transfer = fitted(*preset(ct ? "ct-bone" : "mr"), ct ? "ct-bone" : "mr", loaded);
    if (mode == RayMode::iso)
        layer.isos = iso_surfaces({ct ? 300.0 : low + 0.35 * (high - low)});
    if (mode != RayMode::mip)
        layer.shading = Shading{};
    return layer;
}

TransferFunction default_slice_transfer(const LoadedScene& loaded) {
    const auto [low, high] = usual_range(loaded.data.volume);
    return is_ct(loaded) ? window_function(-160.0, 240.0, 1.0) : window_function(low, high, 1.0);
}

glm::dvec3 surface_color(size_t number) {
    constexpr glm::dvec3 colors[] = {{1.0, 0.94, 0.85}, {0.90, 0.62, 0.50}, {0.6, 0.8, 1.0},
                                     {0.7, 0.95, 0.6},  {1.0, 0.9, 0.4},    {0.85, 0.6, 0.95},
                                     {0.5, 0.9, 0.85},  {1.0, 0.6, 0.6}};
    return colors[number % std::size(colors)];
}

std::vector<IsoSurface> iso_surfaces(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    std::vector<IsoSurface> isos;
    for (size_t i = 0; i < values.size(); ++i) {
        const size_t from_inside = values.size() - 1 - i;
        isos.push_back({values[i], surface_color(from_inside), from_inside == 0 ? 1.0 : 0.35});
    }
    return isos;
}

Camera default_camera(const Scene& scene, const Grid& grid) {
    if (scene.ray_cast || scene.slices.size() != 1)
        return frame_volume(grid, kViews[0].view.towards, kViews[0].view.up);
    const glm::dvec3 normal = glm::normalize(scene.slices[0].normal);
    const glm::dvec3 size = glm::abs(normal);
    // Axial planes are seen from the feet, coronal ones from the front, sagittal ones from the
    // left.
    glm::dvec3 towards = normal, up(0, 0, 1);
    if (size.z >= size.x && size.z >= size.y) {
        towards = normal.z > 0 ? -normal : normal;
        up = {0, -1, 0};
    } else if (size.y >= size.x) {
        towards = normal.y > 0 ? -normal : normal;
    } else {
        towards = normal.x < 0 ? -normal : normal;
    }
    Camera camera = frame_volume(grid, towards, up);
    camera.projection = Projection::orthographic;
    // Fits the volume's extent along the picture's axes.
    const View view = make_view(camera, scene.size_px);
    double half_width = 0, half_height = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index =
            (glm::dvec3(grid.size) - 1.0) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
        const glm::dvec3 arm = world_point(grid, index) - camera.target_mm;
        half_width = std::max(half_width, std::abs(glm::dot(arm, view.right)));
        half_height = std::max(half_height, std::abs(glm::dot(arm, view.up)));
    }
    const double aspect =
        static_cast<double>(scene.size_px.x) / static_cast<double>(scene.size_px.y);
    camera.view_height_mm = std::max(1e-6, 2.04 * std::max(half_height, half_width / aspect));
    return camera;
}

std::optional<ViewDirection> view_direction(const std::string& name) {
    for (const NamedView& view : kViews)
        if (name == view.name)
            return view.view;
    return std::nullopt;
}

std::string view_names() {
    std::string names;
    for (const NamedView& view : kViews)
        names += names.empty() ? view.name : fmt::format(", {}", view.name);
    return names;
}

} // namespace palpate
