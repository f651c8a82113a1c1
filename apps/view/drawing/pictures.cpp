#include "apps/view/drawing/pictures.h"

#include <algorithm>

#include "engine/base/failure.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/gpu/error.h"
#include "engine/image/png.h"
#include "engine/render/seen_box.h"

namespace palpate::view {

std::optional<PixelBox> Pictures::Made::pixels_changed_to(const Made& other) const {
    if (!has_scene_of(other))
        return std::nullopt;
    PixelBox changed = changed_pixels(scene, volume, other.volume);
    if (labels)
        changed = united(changed, changed_pixels(scene, *labels, *other.labels));
    if (overlay)
        changed = united(changed, changed_pixels(scene, *overlay, *other.overlay));
    for (size_t i = 0; i < meshes.size(); ++i) // of one scene: there are as many
        if (meshes[i] != other.meshes[i])
            changed = united(
                changed, united(pixels_of(scene, *meshes[i]), pixels_of(scene, *other.meshes[i])));
    return changed;
}

Pictures::Pictures(GpuDevice& device, Session& session, Options options)
    : eye_(session.add_eye(&wake_)),
      options_(std::move(options)),
      volume_(device,
              [this] {
                  RendererOptions renderer = options_.renderer;
                  renderer.progress = [this, of_options = renderer.progress](double share) {
                      return (!of_options || of_options(share)) &&
                             (!stopping_at_wishes_ || !is_outdated());
                  };
                  return renderer;
              }()),
      slices_{Renderer(volume_.store()), Renderer(volume_.store()), Renderer(volume_.store())},
      images_(device, options_.stay),
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
    wake_.wake();
}

std::vector<Picture> Pictures::take() {
    const std::scoped_lock held(mutex_);
    std::vector<Picture> taken;
    for (std::optional<Picture>& picture : done_)
        if (picture)
            taken.push_back(std::move(*std::exchange(picture, std::nullopt)));
    return taken;
}

void Pictures::print(Print print) {
    const std::scoped_lock held(mutex_);
    if (failure_)
        return; // who waits for it is told so by its end
    print_ = std::move(print);
    wake_.wake();
}

// With a renderer of its own, beside what lies on the device: those of the views keep their
// pictures.
Result<void> Pictures::draw_print(const Print& print) {
    sight_ = eye_.look();
    const Scene scene = made_of(print.wish).scene;
    Renderer renderer(volume_.store());
    PALPATE_TRY(Frame frame, renderer.render(scene, data_for(print.wish, scene)));
    return save_png(print.path, shown_picture(print.look, scene, std::move(frame.eyes), true));
}

std::optional<Pictures::Failure> Pictures::failure() {
    const std::scoped_lock held(mutex_);
    return failure_;
}

void Pictures::run(const std::stop_token& stop) {
    profile::name_thread("pictures");
    try {
        while (!stop.stop_requested()) {
            std::vector<Wish> wishes;
            std::optional<Print> print;
            {
                const std::scoped_lock held(mutex_);
                wishes = wishes_;
                drawing_for_ = wished_;
                print = std::exchange(print_, std::nullopt);
            }
            if (print) {
                print->done(attempt(print->path.string(), [&] { return draw_print(*print); }));
                if (options_.on_picture)
                    options_.on_picture();
            }
            if (!go_on(wishes))
                wake_.wait(stop);
        }
        return;
    } catch (const std::exception& error) { // of the device
        const std::scoped_lock held(mutex_);
        failure_ = {failure_text(error), is_lack_of_memory(error)};
        print_.reset();
    }
    if (options_.on_picture)
        options_.on_picture();
}

// Whether something else is wished for than when the picture under way was begun, or edited.
bool Pictures::is_outdated() {
    if (eye_.look().state.snapshot != sight_->state.snapshot)
        return true;
    const std::scoped_lock held(mutex_);
    return wished_ != drawing_for_ || thread_.get_stop_token().stop_requested();
}

const std::optional<Volume>& Pictures::fused() const {
    return sight_->data.fused ? sight_->data.fused : options_.fused;
}

const std::optional<Volume>& Pictures::overlay() const {
    return sight_->data.overlay ? sight_->data.overlay : options_.overlay;
}

SceneData Pictures::data_for(const Wish& wish, const Scene& scene) const {
    SceneData data = sight_->data;
    if (!scene.labels)
        data.labels.reset();
    data.fused = scene.fusion ? fused() : std::nullopt;
    data.overlay = scene.overlay ? overlay() : std::nullopt;
    data.meshes = options_.meshes;
    data.meshes.resize(scene.surfaces.size());
    std::copy(wish.meshes.rbegin(), wish.meshes.rend(), data.meshes.rbegin());
    return data;
}

Pictures::Made Pictures::made_of(const Wish& wish) const {
    Made made{wish.scene,          wish.display, wish.meshes, sight_->data.volume,
              sight_->data.labels, fused(),      overlay(),   true};
    if (!sight_->data.labels)
        made.scene.labels.reset(); // they may have gone since the wish
    if (!fused())
        made.scene.fusion.reset();
    if (!overlay())
        made.scene.overlay.reset();
    if (!made.scene.labels)
        made.labels.reset();
    if (!made.scene.fusion)
        made.fused.reset();
    if (!made.scene.overlay)
        made.overlay.reset();
    return made;
}

Renderer& Pictures::renderer_of(Panel panel) {
    return is_slice(panel) ? slices_[static_cast<size_t>(panel)] : volume_;
}

Result<std::vector<Picture>> Pictures::draw_full(const Wishes& wishes) {
    const Timer timer;
    Commands commands(images_.device());
    std::vector<PictureImages::Frame> frames;
    for (const auto& [wish, changed] : wishes) {
        const Scene scene = made_of(*wish).scene;
        const SceneData data = data_for(*wish, scene);
        Renderer& renderer = renderer_of(wish->panel);
        const Request request = changed ? Request(ChangedPixels{*changed}) : WholePicture{};
        auto recorded = renderer.record(commands, scene, data, request);
        images_.changed(wish->panel, recorded ? changed : std::nullopt);
        if (!recorded) {
            commands.submit(); // images are as tracked
            return pass_on(recorded);
        }
        frames.push_back({wish->panel, recorded->picture, wish->display});
    }
    std::vector<Picture> pictures = images_.finish(commands, frames);
    for (Picture& picture : pictures)
        picture.ms = timer.ms() / static_cast<double>(pictures.size());
    return pictures;
}

// Nothing where it was given up for another.
Result<std::optional<Picture>> Pictures::draw_volume(const Wish& wish, double budget_ms) {
    const Timer timer;
    const Made wanted = made_of(wish);
    const auto& made = made_[static_cast<size_t>(wish.panel)];
    const bool shows_it = made && made->has_rays_of(wanted);
    const auto laid_out = [&](double error_estimate, bool complete) {
        Commands commands(images_.device());
        const PictureImages::Frame frame{wish.panel, &volume_.picture(), wish.display};
        Picture picture = std::move(images_.finish(commands, std::span(&frame, 1)).front());
        picture.ms = timer.ms();
        picture.error_estimate = error_estimate;
        picture.complete = complete;
        return picture;
    };
    if (shows_it && made->display != wanted.display) // eyes or marks alone
        return laid_out(last_error_, made->complete);
    if (coarse_ && wanted.scene.ray_cast) {
        const SceneData data = data_for(wish, wanted.scene);
        interactive_.set_budget_ms(shows_it ? kLook_ms : budget_ms);
        const auto draw = [&](const std::optional<PixelBox>& changed) {
            auto frame = interactive_.draw(wanted.scene, data, changed);
            images_.changed(wish.panel, frame ? frame->changed : std::nullopt);
            return frame;
        };
        auto drawn = draw(made ? made->pixels_changed_to(wanted) : std::nullopt);
        // Beside pixels that were drawn anew others may be left of a moving picture.
        const bool refines = shows_it || (drawn && drawn->px_per_ray == 1);
        interactive_.set_budget_ms(kLook_ms);
        while (refines && drawn && !drawn->complete && timer.ms() < budget_ms) {
            if (is_outdated()) { // what is refined stays so
                if (shows_it)
                    return std::nullopt;
                break;
            }
            drawn = draw({});
        }
        if (drawn) {
            last_error_ = drawn->error_estimate;
            return laid_out(drawn->error_estimate, drawn->complete);
        }
        coarse_ = false; // as where an atlas is marched in parts
    }
    stopping_at_wishes_ = true;
    Result<std::vector<Picture>> drawn = draw_full({{&wish, std::nullopt}});
    stopping_at_wishes_ = false;
    if (!drawn && is_outdated())
        return std::nullopt;
    if (!drawn)
        return pass_on(drawn);
    last_error_ = 0.0;
    return std::move(drawn->front());
}

bool Pictures::go_on(const std::vector<Wish>& wishes) {
    sight_ = eye_.look();
    Wishes slices;
    const Wish* volume = nullptr;
    bool refines = false;
    for (const Wish& wish : wishes) {
        const auto& made = made_[static_cast<size_t>(wish.panel)];
        const Made wanted = made_of(wish);
        const bool is_there = made && made->has_rays_of(wanted) && made->display == wish.display;
        if (is_there && made->complete)
            continue;
        refines |= is_there;
        if (!is_slice(wish.panel)) {
            volume = &wish;
            continue;
        }
        std::optional<PixelBox> changed;
        if (made && made->complete)
            changed = made->pixels_changed_to(wanted);
        if (changed && changed->empty() && made->display == wish.display)
            made_[static_cast<size_t>(wish.panel)] = wanted; // an edit that it does not show
        else
            slices.push_back({&wish, changed});
    }
    if (slices.empty() && !volume)
        return false;
    volumes_turn_ = volume && (slices.empty() || (volumes_turn_ && !refines));
    if (!volumes_turn_) {
        Result<std::vector<Picture>> drawn = draw_full(slices);
        if (!drawn)
            throw GpuError(drawn.error().message);
        for (size_t i = 0; i < slices.size(); ++i)
            keep(*slices[i].wish, std::move((*drawn)[i]));
        volumes_turn_ = true;
        return true;
    }
    const bool alone = slices.empty() && !refines;
    interactive_.set_aim(kAim, (alone ? 1.7 : 0.5) * options_.frame_ms);
    auto drawn = draw_volume(*volume, alone ? options_.frame_ms : 0.5 * options_.frame_ms);
    if (!drawn)
        throw GpuError(drawn.error().message);
    if (*drawn)
        keep(*volume, std::move(**drawn));
    volumes_turn_ = false;
    return true;
}

void Pictures::keep(const Wish& wish, Picture picture) {
    Made& made = made_[static_cast<size_t>(wish.panel)].emplace(made_of(wish));
    made.complete = picture.complete;
    picture.newest_input_ns = sight_->state.newest_input_ns;
    picture.made_ns = profile::now_ns();
    eye_.reached(EditLag::Reader::picture, *sight_, picture.made_ns);
    {
        const std::scoped_lock held(mutex_);
        done_[static_cast<size_t>(picture.panel)] = std::move(picture);
    }
    if (options_.on_picture)
        options_.on_picture();
}

Result<std::vector<Picture>> Pictures::draw() {
    sight_ = eye_.look();
    Wishes wishes;
    for (const Wish& wish : wishes_)
        wishes.push_back({&wish, std::nullopt});
    return draw_full(wishes);
}

} // namespace palpate::view
