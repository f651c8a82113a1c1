// The part of the viewer that asks for pictures of the views, and takes them.

#include <algorithm>

#include "apps/view/tools/tool.h"
#include "apps/view/window/viewer.h"

namespace palpate::view {

void Viewer::make_pictures() {
    state_of_pictures_ = {};
    pictures_ = std::make_unique<Pictures>(*pictures_device_, work_->session(), pictures_with_);
}

void Viewer::drop_pictures() {
    new_pictures_.clear();
    drawing_->drop_pictures();
    end_figure();
    pictures_.reset();
}

void Viewer::take_pictures() {
    if (!pictures_)
        return;
    for (Picture& picture : pictures_->take()) {
        ++looks_;
        if (saw_picture)
            saw_picture(picture);
        new_pictures_.push_back(std::move(picture));
    }
    for (const Picture& picture : new_pictures_) {
        state_of_pictures_[static_cast<size_t>(picture.panel)] = {
            true, picture.complete, picture.ms, picture.error_estimate};
        if (picture.panel == Panel::volume)
            volume_waits_s_.reset();
    }
    state_of_pictures_[static_cast<size_t>(Panel::volume)].waited_s =
        volume_waits_s_ ? time_s_ - *volume_waits_s_ : 0.0;
}

// A picture of other rays or surfaces may take seconds: a person is shown that it is under way.
void Viewer::note_wish(const Scene& scene) {
    if (scene.ray_cast == volume_wished_.ray_cast && scene.surfaces == volume_wished_.surfaces)
        return;
    volume_wished_.ray_cast = scene.ray_cast;
    volume_wished_.surfaces = scene.surfaces;
    volume_waits_s_ = volume_waits_s_.value_or(time_s_);
}

void Viewer::wish() {
    std::vector<Pictures::Wish> wishes;
    // A brush in the hand: the first stroke shall not wait for rays of another kind.
    const bool has_labels = work_->has_labels() || state_.tool == &kDrawTool;
    for (const Places::View& view : places_of(state_).views)
        wishes.push_back({view.panel,
                          scene_of(state_, work_->subject().grid, view.panel,
                                   work_->session().scene(), has_labels),
                          display_of(state_, view.panel, screen_px_)});
    for (const Pictures::Wish& wish : wishes)
        if (wish.panel == Panel::volume)
            note_wish(wish.scene);
    for (Pictures::Wish& wish : wishes) // the hand's tool lies among the rays, at its depth
        for (const HandLink::Surface& surface : work_->hand().surfaces(state_))
            if (wish.panel == Panel::volume && wish.scene.surfaces.size() < kMaxSurfaces) {
                wish.scene.surfaces.push_back(surface.layer);
                wish.meshes.push_back(surface.mesh);
            }
    pictures_->want(std::move(wishes));
}

Result<void> Viewer::draw_pictures() {
    if (!pictures_)
        make_pictures();
    PALPATE_TRY(new_pictures_, pictures_->draw());
    return {};
}

Result<Image> Viewer::shot() {
    PALPATE_TRY(draw_pictures());
    frame({}, time_s_ + kFrame_s); // the notes know of the pictures
    return capture();
}

Image Viewer::capture() {
    const glm::uvec2 size = state_.size_px;
    Commands commands(*interface_device_);
    UiTarget target{GpuImage(*interface_device_, "shot",
                             {.format = format_, .size = glm::uvec3(size, 1), .attachment = true})};
    record(commands, target);
    const Commands::Region all{0, glm::uvec3(0), glm::uvec3(size, 1)};
    const BufferSlice texels =
        commands.read_back(target.image, std::span(&all, 1), uint64_t{4} * size.x * size.y);
    commands.submit();
    commands.ticket().wait();
    const bool swapped = format_ == VK_FORMAT_B8G8R8A8_UNORM || format_ == VK_FORMAT_B8G8R8A8_SRGB;
    Image image = make_image(size, {"R", "G", "B"});
    const std::byte* from = texels.mapped().data();
    for (size_t i = 0; i < size_t{size.x} * size.y; ++i)
        for (size_t c = 0; c < 3; ++c)
            image.samples[3 * i + c] =
                static_cast<float>(from[4 * i + (swapped ? 2 - c : c)]) / 255.0f;
    return image;
}

} // namespace palpate::view
