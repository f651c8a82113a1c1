#include "apps/view/tools/region_preview.h"

#include <exception>

#include "engine/base/profile.h"

namespace palpate::view {

namespace {

// The sides of one direction: along `along`, between two rows of samples that
// lie beside each other along `beside`.
void append_sides(const ClickRegion& region, int axis, uint32_t layer, int along, int beside,
                  RegionPreview::Sides& sides) {
    const auto has = [&](uint32_t a,
                         uint32_t b) { // in the region's box, from 1 on
        if (a == 0 || b == 0)
            return false;
        glm::uvec3 at(0);
        at[along] = region.low[along] + a - 1;
        at[beside] = region.low[beside] + b - 1;
        at[axis] = layer;
        return region.has(at);
    };
    for (uint32_t b = 0; b <= region.size[beside]; ++b) {
        std::optional<uint32_t> began;
        for (uint32_t a = 0; a <= region.size[along] + 1; ++a) {
            const bool is_side = has(a, b) != has(a, b + 1);
            if (is_side && !began)
                began = a;
            if (is_side || !began)
                continue;
            glm::dvec3 from(0.0);
            from[axis] = layer;
            from[beside] = double(region.low[beside]) + double(b) - 0.5;
            glm::dvec3 to = from;
            from[along] = double(region.low[along]) + double(*began) - 1.5;
            to[along] = double(region.low[along]) + double(a) - 1.5;
            sides.emplace_back(from, to);
            began.reset();
        }
    }
}

} // namespace

RegionPreview::~RegionPreview() {
    if (!thread_.joinable())
        return;
    thread_.request_stop();
    {
        const std::scoped_lock held(mutex_);
        older_.request_stop();
    }
    thread_.join();
}

void RegionPreview::want(const Volume& grey, const RegionClick& click, bool threaded) {
    {
        const std::scoped_lock held(mutex_);
        if (wish_ && wish_->click == click && wish_->grey.is_same_as(grey))
            return;
        wish_ = {grey, click};
        is_new_ = true;
        older_.request_stop();
        wake_.notify_all();
    }
    if (!threaded)
        find(*wish_, {});
    else if (!thread_.joinable())
        thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void RegionPreview::find(const Wish& wish, const std::stop_token& stop) {
    std::shared_ptr<const ClickRegion> found;
    if (Result<ClickRegion> region = region_of(wish.grey, wish.click, {stop, {}}))
        found = std::make_shared<const ClickRegion>(std::move(*region));
    const std::scoped_lock held(mutex_);
    if (!stop.stop_requested())
        region_ = std::move(found);
}

void RegionPreview::run(const std::stop_token& stop) {
    profile::name_thread("region preview");
    while (!stop.stop_requested()) {
        std::optional<Wish> wish;
        std::stop_token older;
        {
            std::unique_lock held(mutex_);
            if (!wake_.wait(held, stop, [&] { return is_new_; }))
                return;
            is_new_ = false;
            is_at_work_ = true;
            wish = wish_;
            older_ = std::stop_source();
            older = older_.get_token();
        }
        try {
            if (wish)
                find(*wish, older);
        } catch (const std::exception&) { // samples that cannot be read: the picture says it
            const std::scoped_lock held(mutex_);
            region_.reset();
        }
        const std::scoped_lock held(mutex_);
        is_at_work_ = false;
        wake_.notify_all();
    }
}

void RegionPreview::wait() {
    std::unique_lock held(mutex_);
    wake_.wait(held, [&] { return !thread_.joinable() || (!is_new_ && !is_at_work_); });
}

std::shared_ptr<const ClickRegion> RegionPreview::region() {
    const std::scoped_lock held(mutex_);
    return region_;
}

std::shared_ptr<const RegionPreview::Sides> RegionPreview::sides(int axis, uint32_t layer) {
    const std::shared_ptr<const ClickRegion> now = region();
    Drawn& drawn = drawn_[static_cast<size_t>(axis)];
    if (drawn.of == now && drawn.layer == layer)
        return drawn.sides;
    auto sides = std::make_shared<Sides>();
    if (now) {
        const int across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
        append_sides(*now, axis, layer, across, down, *sides);
        append_sides(*now, axis, layer, down, across, *sides);
    }
    drawn = {now, layer, std::move(sides)};
    return drawn.sides;
}

} // namespace palpate::view
