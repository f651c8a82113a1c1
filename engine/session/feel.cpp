#include "engine/session/feel.h"

#include <cmath>

#include "engine/session/default_scene.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate {

using haptics::TouchSource;

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
    const ValueRange range = loaded.data.volume.range();
    return loaded.modality == "CT" ? zero_hu(loaded) + 300.0
                                   : 0.5 * (double{range.min} + double{range.max});
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
    const bool labels = feel.parameters.source == TouchSource::labels;
    if (!mesh)
        mesh = std::make_shared<const Mesh>(haptics::touch_surface(
            labels ? *feel.scene.labels : *feel.scene.grey, feel.parameters));
    const glm::dvec3 spacing = spacing_mm(feel.scene.grey->grid());
    feel.scene.mesh = mesh;
    feel.scene.touch_mesh =
        haptics::make_touch_mesh(mesh, 0.5 * std::cbrt(spacing.x * spacing.y * spacing.z));
}

SessionSetup session_setup(Feel& feel) {
    const Volume& grey = *feel.scene.grey;
    const bool on_labels = feel.edit && feel.edit->operation.on_labels();
    // Where SCENE itself is the label map, there is one volume.
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
    if (feel.edit) {
        feel.edit->on = "volume";
        feel.edit->guide = on_labels ? grey_name : "";
    }
    return {.document = std::move(document),
            .grey = grey_name,
            .labels = labels_name,
            .touch = feel.scene,
            .parameters = feel.parameters};
}

} // namespace palpate
