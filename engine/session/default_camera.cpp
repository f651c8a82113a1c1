#include <algorithm>
#include <cmath>

#include "engine/session/default_scene.h"
#include "engine/volume/thickness.h"

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

// The nearest eye from which boxes lie within the picture, seen along one direction. A point at (x,
// y) to the side and z ahead of the eye is in the picture while |x| <= z half_width and |y| <= z
// half_height, so that each bound of the picture is a half space of eyes, and the nearest eye lies
// where two opposite ones meet.
class Fit {
 public:
    Fit(const Grid& grid, const ViewDirection& from, glm::uvec2 size_px)
        : grid_(grid), camera_(frame_volume(grid, from.towards, from.up)) {
        constexpr double kFilled = 0.94; // of the picture's half width and height
        view_ = make_view(camera_, size_px);
        slope_ = kFilled * glm::dvec2(view_.right_edge, view_.top);
    }

    // A box in index space.
    void add(glm::dvec3 low, glm::dvec3 high) {
        low = glm::max(low, 0.0);
        high = glm::min(high, glm::dvec3(grid_.size) - 1.0);
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 side(corner & 1, corner >> 1 & 1, corner >> 2);
            const glm::dvec3 arm =
                world_point(grid_, glm::mix(low, high, side)) - camera_.target_mm;
            const glm::dvec2 across(glm::dot(arm, view_.right), glm::dot(arm, view_.up));
            const double z = glm::dot(arm, view_.forward);
            least_ = glm::max(least_, across - slope_ * z);
            most_ = glm::min(most_, across + slope_ * z);
            low_ = glm::min(low_, glm::dvec3(across, z));
            high_ = glm::max(high_, glm::dvec3(across, z));
        }
    }
    bool empty() const { return low_.z > high_.z; }

    // Looks at the middle depth of what was added; there is something.
    Camera camera() const {
        const glm::dvec2 across = 0.5 * (least_ + most_);
        const glm::dvec2 nearest = 0.5 * (most_ - least_) / slope_;
        const double middle = 0.5 * (low_.z + high_.z);
        const double radius = 0.5 * glm::length(high_ - low_);
        const double z = std::min({nearest.x, nearest.y, middle - 1e-3 * std::max(radius, 1e-3)});
        Camera camera = camera_;
        const auto place = [&](double ahead) {
            return camera_.target_mm + across.x * view_.right + across.y * view_.up +
                   ahead * view_.forward;
        };
        camera.eye_mm = place(z);
        camera.target_mm = place(middle);
        const glm::dvec2 half =
            glm::max(glm::dvec2(high_) - across, across - glm::dvec2(low_)) / slope_;
        camera.view_height_mm = std::max(2.0 * view_.top * std::max(half.x, half.y), 1e-6);
        return camera;
    }

 private:
    const Grid& grid_;
    Camera camera_;
    View view_;
    glm::dvec2 slope_{}; // of the picture's bounds
    glm::dvec2 least_{-INFINITY}, most_{INFINITY};
    glm::dvec3 low_{INFINITY}, high_{-INFINITY}; // along right, up and forward
};

// Whether rays may see any of these values.
bool seen(const RayCastLayer& layer, ValueRange range) {
    constexpr double kVisible = 0.01; // opacity of a unit
    if (layer.mode == RayMode::iso)
        return range.max >= layer.isos.front().value;
    const TransferFunction& function = layer.transfer;
    double most = std::max(opacity_at(function, range.min), opacity_at(function, range.max));
    for (const auto& point : function.opacities)
        if (range.min <= point.value && point.value <= range.max)
            most = std::max(most, point.opacity);
    return most > kVisible;
}

// Adds where values lie that can be seen, to blocks of 8^3 samples, or to whole bricks in large
// volumes: by what is known of each brick and block, so that no sample is read.
void add_visible(const Scene& scene, const SceneData& data, Fit& fit) {
    constexpr uint32_t kManyBricks = 4096;
    const Volume& volume = data.volume;
    const bool shows_labels = data.labels && data.labels->is_same_as(volume);
    const auto shows = [&](ValueRange range) {
        return !range.empty() && (shows_labels ? range.max > 0.0f : seen(*scene.ray_cast, range));
    };
    const glm::uvec3 bricks = volume.brick_count();
    const bool many = uint64_t{bricks.x} * bricks.y * bricks.z > kManyBricks;
    for_each_brick(volume, [&](glm::uvec3 position) {
        const Brick& brick = volume.brick(position);
        const glm::dvec3 corner(position * kBrickSide);
        if (!shows(brick.range()))
            return;
        if (many || brick.is_constant()) {
            fit.add(corner - 1.0, corner + double{kBrickSide});
            return;
        }
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block) {
            const glm::uvec3 at(block % kBlocksPerSide, block / kBlocksPerSide % kBlocksPerSide,
                                block / (kBlocksPerSide * kBlocksPerSide));
            const glm::dvec3 low = corner + glm::dvec3(at * kBlockSide);
            if (shows(brick.block_range(block))) // up to the samples beside it
                fit.add(low - 1.0, low + double{kBlockSide});
        }
    });
}

Camera fitted_camera(const Scene& scene, const SceneData& data) {
    const Grid grid = thickened(data.volume.grid());
    Fit fit(grid, kViews[0].view, scene.size_px);
    const bool labels = data.labels && data.labels->is_same_as(data.volume);
    if (labels || (scene.ray_cast && scene.slices.empty() && scene.surfaces.empty()))
        add_visible(scene, data, fit);
    if (fit.empty())
        fit.add(glm::dvec3(0.0), glm::dvec3(grid.size));
    return fit.camera();
}

} // namespace

Camera default_camera(const Scene& scene, const SceneData& data) {
    const Grid grid = thickened(data.volume.grid());
    if (scene.ray_cast || scene.slices.size() != 1)
        return fitted_camera(scene, data);
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

std::vector<std::string> view_names() {
    std::vector<std::string> names;
    for (const NamedView& view : kViews)
        names.emplace_back(view.name);
    return names;
}

} // namespace palpate
