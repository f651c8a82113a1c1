#include "apps/palpate/view/pictures.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/gpu/error.h"

namespace palpate::view {

namespace {

constexpr std::chrono::milliseconds kNap(3); // while nothing is wished for: edits come unasked

Picture picture_of(Renderer& renderer, Panel panel, double ms) {
    const Image image = renderer.read_back().front();
    Picture picture{panel, image.size_px, {}, ms, 0.0, true};
    const size_t channels = image.channels.size();
    const size_t count = size_t{image.size_px.x} * image.size_px.y;
    picture.rgba.resize(4 * count);
    for (size_t i = 0; i < count; ++i) {
        for (size_t c = 0; c < 3; ++c) {
            const float v = image.samples[i * channels + c]; // NaN becomes 0
            picture.rgba[4 * i + c] = static_cast<std::byte>(
                static_cast<int>(v > 0.0f ? std::lround(255.0f * std::min(v, 1.0f)) : 0));
        }
        picture.rgba[4 * i + 3] = std::byte{255};
    }
    return picture;
}

uint64_t version_of(const std::optional<Volume>& volume) {
    return volume ? volume->version() : 0;
}

} // namespace

Pictures::Pictures(GpuDevice& device, Session& session, Options options)
    : eye_(session.add_eye()),
      options_(std::move(options)),
      volume_(device, options_.renderer),
      slices_{Renderer(volume_.store()), Renderer(volume_.store()), Renderer(volume_.store())},
      interactive_(volume_, options_.frame_ms) {
    if (options_.threaded)
        thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Pictures::~Pictures() {
    if (thread_.joinable()) {
        thread_.request_stop();
        thread_.join();
    }
}

void Pictures::want(std::vector<Wish> wishes) {
    const std::scoped_lock held(mutex_);
    if (wishes == wishes_)
        return;
    wishes_ = std::move(wishes);
    ++wished_;
    wake_.notify_one();
}

std::vector<Picture> Pictures::take() {
    const std::scoped_lock held(mutex_);
    std::vector<Picture> taken;
    for (std::optional<Picture>& picture : done_)
        if (picture)
            taken.push_back(std::move(*std::exchange(picture, std::nullopt)));
    return taken;
}

std::optional<std::string> Pictures::failure() {
    const std::scoped_lock held(mutex_);
    return failure_;
}

void Pictures::run(const std::stop_token& stop) {
    profile::name_thread("pictures");
    try {
        while (!stop.stop_requested()) {
            std::vector<Wish> wishes;
            uint64_t wished = 0;
            {
                const std::scoped_lock held(mutex_);
                wishes = wishes_;
                wished = wished_;
            }
            if (go_on(wishes))
                continue;
            std::unique_lock held(mutex_);
            wake_.wait_for(held, stop, kNap, [&] { return wished_ != wished; });
        }
        return;
    } catch (const std::exception& error) { // of the device
        const std::scoped_lock held(mutex_);
        failure_ = error.what();
    }
    if (options_.on_picture)
        options_.on_picture();
}

SceneData Pictures::data_for(const Scene& scene) const {
    SceneData data = sight_->data;
    if (!scene.labels)
        data.labels.reset();
    data.meshes = options_.meshes;
    data.meshes.resize(scene.surfaces.size());
    return data;
}

Pictures::Made Pictures::made_of(const Wish& wish) const {
    Made made{wish.scene, sight_->data.volume.version(), version_of(sight_->data.labels), false};
    if (!sight_->data.labels)
        made.scene.labels.reset(); // they may have gone since the wish
    if (!made.scene.labels)
        made.labels = 0;
    return made;
}

Renderer& Pictures::renderer_of(Panel panel) {
    return is_slice(panel) ? slices_[static_cast<size_t>(panel)] : volume_;
}

Result<Picture> Pictures::draw_full(const Wish& wish) {
    const Timer timer;
    const Scene scene = made_of(wish).scene;
    Renderer& renderer = renderer_of(wish.panel);
    PALPATE_TRY(renderer.draw(scene, data_for(scene)));
    return picture_of(renderer, wish.panel, timer.ms());
}

Result<Picture> Pictures::draw_volume(const Wish& wish) {
    const Timer timer;
    const Scene scene = made_of(wish).scene;
    if (coarse_ && scene.ray_cast) {
        const Result<InteractiveFrame> drawn = interactive_.draw(scene, data_for(scene));
        if (drawn) {
            Picture picture = picture_of(volume_, wish.panel, timer.ms());
            picture.complete = drawn->complete;
            picture.error_estimate = drawn->error_estimate;
            return picture;
        }
        coarse_ = false; // as where an atlas is marched in parts
    }
    return draw_full(wish);
}

bool Pictures::go_on(const std::vector<Wish>& wishes) {
    sight_ = eye_.look();
    const Wish* next = nullptr;
    uint64_t best = UINT64_MAX; // what changed comes before what is refined
    for (const Wish& wish : wishes) {
        const auto panel = static_cast<size_t>(wish.panel);
        Made wanted = made_of(wish);
        const bool refines = made_[panel] && *made_[panel] == wanted;
        wanted.complete = true;
        if (made_[panel] && *made_[panel] == wanted)
            continue;
        const uint64_t rank = refines ? UINT64_MAX - 1 : turns_[panel];
        if (rank < best) {
            best = rank;
            next = &wish;
        }
    }
    if (!next)
        return false;
    Result<Picture> picture = is_slice(next->panel) ? draw_full(*next) : draw_volume(*next);
    if (!picture)
        throw GpuError(picture.error().message);
    Made& made = made_[static_cast<size_t>(next->panel)].emplace(made_of(*next));
    made.complete = picture->complete;
    turns_[static_cast<size_t>(next->panel)] = ++turn_;
    eye_.reached(EditLag::Reader::picture, *sight_, profile::now_ns());
    hand_over(std::move(*picture));
    return true;
}

void Pictures::hand_over(Picture picture) {
    {
        const std::scoped_lock held(mutex_);
        done_[static_cast<size_t>(picture.panel)] = std::move(picture);
    }
    if (options_.on_picture)
        options_.on_picture();
}

Result<std::vector<Picture>> Pictures::draw() {
    sight_ = eye_.look();
    std::vector<Picture> pictures;
    for (const Wish& wish : wishes_) {
        PALPATE_TRY(Picture picture, draw_full(wish));
        pictures.push_back(std::move(picture));
    }
    return pictures;
}

} // namespace palpate::view
