#include "apps/view/panels/series_previews.h"

#include <algorithm>
#include <cmath>

#include "apps/view/window/slice_view.h"
#include "engine/base/failure.h"
#include "engine/base/percentile.h"
#include "engine/session/default_scene.h"

namespace palpate::view {

namespace {

struct GreyRange {
    double low, high;
};

GreyRange window_of(const LoadedVolume& loaded, std::vector<double> values) {
    if (loaded.modality == "CT") {
        const LoadedScene scene{{loaded.volume, std::nullopt, {}}, loaded.modality, {}, {}, {}, {}};
        const TransferFunction grey = default_slice_transfer(scene);
        if (!grey.colors.empty())
            return {grey.colors.front().value, grey.colors.back().value};
    }
    std::erase_if(values, [](double value) { return std::isnan(value); });
    if (values.empty())
        return {0.0, 1.0};
    const double low = percentile(values, 0.01), high = percentile(values, 0.99);
    return {low, low < high ? high : low + 1.0};
}

} // namespace

// The plane of a picture: as the axial view has it, or, of a single image and of samples that are
// much finer in another plane, in the plane of the image, turned as the view of it is.
static SliceView preview_plane(const Grid& grid) {
    constexpr double kMostUneven = 3.0;
    const std::array<SliceView, kSlicePanels> views = slice_views(grid);
    const glm::dvec3 spacing = spacing_mm(grid);
    const auto along = [&](const SliceView& view) { // the axis of the samples
        size_t nearest = 0;
        double most = -1.0;
        for (size_t axis = 0; axis < 3; ++axis)
            if (const double part =
                    std::abs(glm::dot(view.towards,
                                      glm::dvec3(grid.world_from_index[static_cast<int>(axis)]))) /
                    spacing[static_cast<int>(axis)];
                part > most) {
                most = part;
                nearest = axis;
            }
        return nearest;
    };
    const size_t axial = along(views[0]);
    const double first = spacing[(axial + 1) % 3], second = spacing[(axial + 2) % 3];
    if (axial == 2 ||
        (grid.size.z > 1 && std::max(first, second) <= kMostUneven * std::min(first, second)))
        return views[0];
    return *std::ranges::find_if(views, [&](const SliceView& view) { return along(view) == 2; });
}

std::vector<std::byte> preview_of(const LoadedVolume& loaded, uint32_t side_px) {
    const Volume& volume = loaded.volume;
    const Grid& grid = volume.grid();
    const SliceView plane = preview_plane(grid);
    const glm::dvec3 size(grid.size), middle = 0.5 * (size - 1.0);
    const glm::dmat3 axes(grid.world_from_index);
    const auto extent_mm = [&](glm::dvec3 direction) {
        const glm::dvec3 parts = glm::transpose(axes) * direction;
        return glm::dot(glm::abs(parts), size);
    };
    const double mm_per_px = std::max(extent_mm(plane.right), extent_mm(plane.up)) / side_px;
    const glm::dmat3 index_from_mm = glm::inverse(axes);
    constexpr double kRounding = 1e-6; // of a sample: one halfway is the next one
    std::vector<double> values(size_t{side_px} * side_px, std::nan(""));
    for (uint32_t y = 0; y < side_px; ++y)
        for (uint32_t x = 0; x < side_px; ++x) {
            const glm::dvec2 off = (glm::dvec2(x, y) + 0.5 - 0.5 * side_px) * mm_per_px;
            const glm::dvec3 index =
                middle + index_from_mm * (off.x * plane.right - off.y * plane.up);
            const glm::dvec3 at = glm::floor(index + 0.5 + kRounding);
            if (glm::all(glm::greaterThanEqual(at, glm::dvec3(0.0))) &&
                glm::all(glm::lessThan(at, size)))
                values[size_t{y} * side_px + x] = double{volume.value(glm::uvec3(at))};
        }
    const GreyRange window = window_of(loaded, values);
    std::vector<std::byte> rgba;
    for (const double value : values) {
        const double share = std::isnan(value) ? 0.0
                             : loaded.inverted ? (window.high - value) / (window.high - window.low)
                                               : (value - window.low) / (window.high - window.low);
        const auto grey = static_cast<std::byte>(std::lround(255.0 * std::clamp(share, 0.0, 1.0)));
        rgba.insert(rgba.end(), {grey, grey, grey, std::byte{255}});
    }
    return rgba;
}

SeriesPreviews::SeriesPreviews(Read read, std::string path, std::vector<uint32_t> numbers,
                               bool threaded)
    : SeriesPreviews(
          [read = std::move(read), path = std::move(path), numbers](
              size_t i, const std::stop_token& stop) -> Result<std::vector<std::byte>> {
              PALPATE_TRY(const LoadedVolume loaded, read(path, numbers[i], stop));
              return preview_of(loaded, kSide_px);
          },
          numbers.size(), threaded) {}

SeriesPreviews::SeriesPreviews(Make make, size_t count, bool threaded)
    : make_(std::move(make)),
      states_(std::min(count, kMost), State::waiting),
      rgba_(size_t{4} * size_px().x * size_px().y) {
    if (threaded)
        thread_ = std::jthread([this](const std::stop_token& stop) { make_all(stop); });
    else
        make_all({});
}

glm::uvec2 SeriesPreviews::size_px() const {
    const auto rows = static_cast<uint32_t>((states_.size() + kAcross - 1) / kAcross);
    return kSide_px * glm::uvec2(kAcross, std::max(rows, 1u));
}

void SeriesPreviews::make_all(const std::stop_token& stop) {
    for (size_t i = 0; i < states_.size() && !stop.stop_requested(); ++i) {
        const auto preview = attempt("preview", [&] { return make_(i, stop); });
        Made made{i, preview.value_or(std::vector<std::byte>())}; // empty: none can be made
        const std::lock_guard lock(mutex_);
        made_.push_back(std::move(made));
    }
}

bool SeriesPreviews::poll() {
    std::vector<Made> come;
    {
        const std::lock_guard lock(mutex_);
        come.swap(made_);
    }
    for (const Made& made : come) {
        states_[made.i] = made.rgba.empty() ? State::none : State::there;
        const glm::uvec2 corner = corner_px(made.i);
        for (uint32_t y = 0; y < kSide_px && !made.rgba.empty(); ++y)
            std::copy_n(made.rgba.begin() + size_t{4} * y * kSide_px, size_t{4} * kSide_px,
                        rgba_.begin() + size_t{4} * ((corner.y + y) * size_px().x + corner.x));
    }
    return !come.empty();
}

} // namespace palpate::view
