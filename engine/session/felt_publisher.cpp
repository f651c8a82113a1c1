#include "engine/session/felt_publisher.h"

#include <utility>

namespace palpate {

namespace {

bool same(const std::optional<Volume>& a, const std::optional<Volume>& b) {
    return a.has_value() == b.has_value() && (!a || a->is_same_as(*b));
}

} // namespace

haptics::TouchScene FeltPublisher::scene_of(const SessionSources& sources, uint64_t chosen,
                                            const Document& document, uint64_t snapshot) {
    haptics::TouchScene scene = sources.touch;
    scene.grey = volume_of(document, sources.grey);
    scene.labels = volume_of(document, sources.labels);
    scene.version = chosen << kSnapshotBits | snapshot;
    return scene;
}

FeltPublisher::FeltPublisher(Editor& editor, const Document& first,
                             Mailbox<SessionSources>& sources,
                             Mailbox<haptics::TouchParameters>& parameters,
                             std::shared_ptr<haptics::TouchSurface> surface)
    : scenes_(std::make_unique<const haptics::TouchScene>(scene_of(sources.latest(), 0, first, 0))),
      states_(editor.add_reader()),
      sources_(sources.add_reader()),
      parameters_(parameters.add_reader()),
      surface_(std::move(surface)),
      mesh_(sources.latest().touch.touch_mesh),
      first_mesh_(mesh_) {}

bool FeltPublisher::publish() {
    const auto sources = sources_.pin();
    const auto state = states_.pin();
    const bool chosen = sources.epoch() != sources_epoch_;
    if (state->snapshot == snapshot_ && !chosen)
        return false;
    const haptics::TouchScene& now = scenes_.latest();
    haptics::TouchScene next =
        scene_of(*sources, sources.epoch() - 1, state->document, state->snapshot);
    if (surface_ && next.touch_mesh == first_mesh_) {
        const std::optional<Volume>& volume =
            parameters_.pin()->source == haptics::TouchSource::labels ? next.labels : next.grey;
        if (volume && volume->version() != surface_->volume().version()) {
            surface_->follow(*volume);
            mesh_ = surface_->mesh();
        }
        next.touch_mesh = mesh_;
    }
    if (chosen || !same(now.grey, next.grey) || !same(now.labels, next.labels))
        scenes_.publish(std::make_unique<const haptics::TouchScene>(std::move(next)));
    snapshot_ = state->snapshot;
    sources_epoch_ = sources.epoch();
    return true;
}

std::optional<Volume> FeltPublisher::felt_volume() {
    const haptics::TouchScene& felt = scenes_.latest();
    return parameters_.pin()->source == haptics::TouchSource::labels ? felt.labels : felt.grey;
}

} // namespace palpate
