#include "apps/view/window/small_pictures.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "apps/view/panels/series_previews.h"
#include "engine/base/assert.h"
#include "engine/image/png.h"

namespace palpate::view {

namespace fs = std::filesystem;

namespace {

constexpr uint32_t kSide_px = SeriesPreviews::kSide_px;

// FNV-1a, 64 bits.
std::string name_of_picture(const std::string& path) {
    uint64_t hash = 0xcbf29ce484222325u;
    for (const char letter : path)
        hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001b3u;
    return fmt::format("{:016x}.png", hash);
}

} // namespace

Result<void> keep_small_picture(const fs::path& folder, const std::string& path,
                                const std::vector<std::byte>& rgba) {
    if (folder.empty())
        return {};
    PALPATE_ASSERT_CMP(rgba.size(), ==, size_t{4} * kSide_px * kSide_px);
    std::error_code error;
    fs::create_directories(folder, error); // saving tells of a failure
    Image image = make_image({kSide_px, kSide_px}, {"R", "G", "B"});
    for (size_t i = 0; i < size_t{kSide_px} * kSide_px; ++i)
        for (size_t c = 0; c < 3; ++c)
            image.samples[3 * i + c] = static_cast<float>(rgba[4 * i + c]) / 255.0f;
    return save_png(folder / name_of_picture(path), image);
}

Result<std::vector<std::byte>> load_small_picture(const fs::path& folder, const std::string& path) {
    const fs::path file = folder / name_of_picture(path);
    PALPATE_TRY(const Image image, load_png(file));
    if (image.size_px != glm::uvec2(kSide_px) || image.channels.size() < 3)
        return fail("{}: expected {} x {} pixels in colour, found {} x {}", file.string(), kSide_px,
                    kSide_px, image.size_px.x, image.size_px.y);
    std::vector<std::byte> rgba;
    for (uint32_t y = 0; y < kSide_px; ++y)
        for (uint32_t x = 0; x < kSide_px; ++x) {
            for (size_t c = 0; c < 3; ++c)
                rgba.push_back(static_cast<std::byte>(
                    std::lround(255.0f * std::clamp(image.at(x, y, c), 0.0f, 1.0f))));
            rgba.push_back(std::byte{255});
        }
    return rgba;
}

void forget_small_pictures(const fs::path& folder, const std::vector<std::string>& listed) {
    std::set<std::string> kept;
    for (const std::string& path : listed)
        kept.insert(name_of_picture(path));
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
        if (!kept.count(entry.path().filename()))
            fs::remove(entry.path(), error);
}

} // namespace palpate::view
