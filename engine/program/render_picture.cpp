#include "engine/program/render_picture.h"

#include "engine/annotate/strokes.h"
#include "engine/base/profile.h"
#include "engine/image/png.h"
#include "engine/render/display_layout.h"

namespace palpate {

namespace {

// Colours alone: they already contain the background, and a viewer would blend them once more.
Image without_alpha(const Image& image) {
    Image opaque = make_image(image.size_px, {"R", "G", "B"});
    for (uint32_t y = 0; y < image.size_px.y; ++y)
        for (uint32_t x = 0; x < image.size_px.x; ++x)
            for (size_t c = 0; c < 3; ++c)
                opaque.at(x, y, c) = image.at(x, y, c);
    return opaque;
}

// As a PNG has it.
Image colors_of(const Image& image, const PictureLook& look) {
    return look.transparent ? with_straight_alpha(image) : without_alpha(image);
}

Result<void> save_picture(const std::filesystem::path& path, const Image& image,
                          const PictureLook& look, const ImageMetadata& metadata) {
    if (path.extension() == ".png")
        return save_png(path, colors_of(image, look), look.dots_per_inch);
    return save_exr(path, image, look.precision, metadata);
}

// "dir/name_left.png" from "dir/name.png".
std::filesystem::path with_suffix(std::filesystem::path path, const char* suffix) {
    return path.replace_filename(path.stem().string() + suffix + path.extension().string());
}

} // namespace

std::vector<std::filesystem::path> frame_paths(const std::filesystem::path& path,
                                               std::optional<StereoLayout> layout) {
    if (layout == StereoLayout::separate && !path.empty())
        return {with_suffix(path, "_left"), with_suffix(path, "_right")};
    return {path};
}

Image shown_picture(const PictureLook& look, const Scene& scene, std::vector<Image> eyes,
                    bool colors_alone) {
    annotate(eyes, scene, look.figure);
    DisplayLayout display = display_layout(scene);
    if (display.layout == StereoLayout::separate)
        display.layout = StereoLayout::side_by_side;
    Image image = display_image(eyes, display);
    return colors_alone ? colors_of(image, look) : image;
}

Result<void> save_frame(const std::filesystem::path& path, const PictureLook& look,
                        const Scene& scene, std::vector<Image> eyes,
                        const ImageMetadata& metadata) {
    const profile::Scope scope("save");
    annotate(eyes, scene, look.figure);
    DisplayLayout display = display_layout(scene);
    if (display.layout != StereoLayout::separate)
        return save_picture(path, display_image(eyes, display), look, metadata);
    const auto paths = frame_paths(path, display.layout);
    for (const StereoLayout eye : {StereoLayout::left, StereoLayout::right}) {
        display.layout = eye;
        PALPATE_TRY(save_picture(paths[eye == StereoLayout::right], display_image(eyes, display),
                                 look, metadata));
    }
    return {};
}

} // namespace palpate
