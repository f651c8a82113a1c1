#include "apps/view/panels/series_previews.h"

#include <algorithm>
#include <cmath>

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

std::vector<std::byte> preview_of(const LoadedVolume& loaded, uint32_t side_px) {
    const Volume& volume = loaded.volume;
    const Grid& grid = volume.grid();
    const glm::dvec2 spacing(spacing_mm(grid)), size(grid.size);
    const glm::dvec2 extent_mm = size * spacing;
    const double mm_per_px = std::max(extent_mm.x, extent_mm.y) / side_px;
    std::vector<double> values(size_t{side_px} * side_px, std::nan(""));
    for (uint32_t y = 0; y < side_px; ++y)
        for (uint32_t x = 0; x < side_px; ++x) {
            const glm::dvec2 from_middle = glm::dvec2(x, y) + 0.5 - 0.5 * side_px;
            const glm::dvec2 at = glm::floor(from_middle * mm_per_px / spacing + 0.5 * size);
            if (at.x >= 0.0 && at.y >= 0.0 && at.x < size.x && at.y < size.y)
                values[size_t{y} * side_px + x] =
                    double{volume.value(glm::uvec3(at, grid.size.z / 2))};
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
