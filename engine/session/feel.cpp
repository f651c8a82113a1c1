#include "engine/session/feel.h"

#include <algorithm>
#include <cmath>

#include "engine/session/default_scene.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate {

using haptics::TouchSource;

namespace {

// The range without what stands apart in it: a value of few samples that lies a thousand times as
// far out as all but a thousandth of them reach, as of a damaged voxel. Only floats hold such
// values.
ValueRange usual_range(const Volume& volume) {
    constexpr double kApart = 1000.0;
    const ValueRange whole = volume.range();
    if (volume.type() != ScalarType::f32)
        return whole;
    const glm::uvec3 size = volume.size();
    const uint32_t stride = std::max(1u, std::max({size.x, size.y, size.z}) / 64u);
    std::vector<float> values;
    for (uint32_t z = 0; z < size.z; z += stride)
        for (uint32_t y = 0; y < size.y; y += stride)
            for (uint32_t x = 0; x < size.x; x += stride)
                if (const float value = volume.value({x, y, z}); std::isfinite(value))
                    values.push_back(value);
    if (values.empty())
        return whole;
    const auto quantile = [&](double share) {
        const auto at =
            values.begin() + static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
        std::nth_element(values.begin(), at, values.end());
        return *at;
    };
    const float low = quantile(0.001), high = quantile(0.999);
    const double apart = kApart * (double{high} - double{low});
    if (!(apart > 0.0))
        return whole;
    return {whole.min < low - apart ? low : whole.min, whole.max > high + apart ? high : whole.max};
}

} // namespace

Feel felt_by_default(const LoadedScene& loaded) {
    const Volume& volume = loaded.data.volume;
    Feel feel{.scene = {.grey = volume, .labels = loaded.data.labels, .version = volume.version()},
              .parameters = {.iso = default_iso(loaded)},
              .edit = {}};
    if (!feel.scene.labels && (volume.type() == ScalarType::u8 || volume.type() == ScalarType::u16))
        feel.scene.labels = volume;
    return feel;
}

double default_iso(const LoadedScene& loaded) {
    if (const std::optional<double> bone = bone_value(loaded))
        return *bone;
    const ValueRange range = usual_range(loaded.data.volume);
    return std::clamp(0.5 * (double{range.min} + double{range.max}), -haptics::MostTouch::value,
                      haptics::MostTouch::value);
}

TouchSource default_source(const Feel& feel) {
    const bool changes_labels = feel.edit && feel.edit->operation.on_labels() &&
                                feel.edit->operation.kind != OperationKind::draw;
    return changes_labels || feel.parameters.label_count > 0 ? TouchSource::labels
                                                             : TouchSource::grey;
}

haptics::HapticTransfer opacity_to_touch(const TransferFunction& function) {
    std::vector<TransferFunction::OpacityPoint> points = function.opacities;
    while (points.size() > haptics::HapticTransfer::kMostPoints) {
        size_t least = 1;
        double loss = INFINITY;
        for (size_t i = 1; i + 1 < points.size(); ++i) {
            TransferFunction without{{}, {points[i - 1], points[i + 1]}};
            const double change =
                std::abs(opacity_at(without, points[i].value) - points[i].opacity);
            if (change < loss) {
                loss = change;
                least = i;
            }
        }
        points.erase(points.begin() + static_cast<ptrdiff_t>(least));
    }
    haptics::HapticTransfer transfer;
    for (const auto& [value, opacity] : points) {
        const uint32_t at = transfer.point_count++;
        transfer.values[at] =
            at > 0 ? std::max(value, std::nextafter(transfer.values[at - 1], INFINITY)) : value;
        transfer.forces_n[at] = opacity;
    }
    return transfer;
}

void add_felt_mesh(Feel& feel, std::shared_ptr<const Mesh> mesh) {
    const glm::dvec3 spacing = spacing_mm(feel.scene.grey->grid());
    const double cell_mm = 0.5 * std::cbrt(spacing.x * spacing.y * spacing.z);
    const bool labels = feel.parameters.source == TouchSource::labels;
    const Volume& felt = labels ? *feel.scene.labels : *feel.scene.grey;
    if (!mesh && feel.edit) {
        feel.surface = std::make_shared<haptics::TouchSurface>(felt, feel.parameters);
        feel.scene.touch_mesh = feel.surface->mesh();
        feel.scene.mesh = feel.scene.touch_mesh->mesh;
        return;
    }
    const bool is_of_samples = !mesh;
    if (is_of_samples)
        mesh = std::make_shared<const Mesh>(haptics::touch_surface(felt, feel.parameters));
    feel.scene.mesh = mesh;
    auto made =
        std::make_shared<haptics::TouchMesh>(*haptics::make_touch_mesh(feel.scene.mesh, cell_mm));
    made->is_of_samples = is_of_samples;
    feel.scene.touch_mesh = made;
}

SessionSetup session_setup(Feel& feel) {
    const Volume& grey = *feel.scene.grey;
    const bool on_labels = feel.edit && feel.edit->operation.on_labels();
    // There is one volume if SCENE itself is the label map.
    const bool is_one = feel.scene.labels && feel.scene.labels->is_same_as(grey);
    std::string grey_name = "volume", labels_name = feel.scene.labels ? "volume" : "";
    Document document(on_labels ? *feel.scene.labels : grey,
                      on_labels ? VolumeKind::labels : VolumeKind::grey);
    if (on_labels && !is_one) {
        grey_name = "guide";
        document = with_volume(document, {grey_name, VolumeKind::grey, grey});
    } else if (feel.scene.labels && !is_one) {
        labels_name = "labels";
        document = with_volume(document, {labels_name, VolumeKind::labels, *feel.scene.labels});
    }
    for (std::optional<EditSetup>* edit : {&feel.edit, &feel.second_edit})
        if (*edit) {
            (*edit)->on = "volume";
            (*edit)->guide = on_labels ? grey_name : labels_name;
        }
    return {.document = std::move(document),
            .grey = grey_name,
            .labels = labels_name,
            .touch = feel.scene,
            .parameters = feel.parameters,
            .felt_surface = feel.surface};
}

} // namespace palpate
