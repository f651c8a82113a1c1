#include "engine/render/display_pass.h"

#include <algorithm>

#include "engine/base/assert.h"
#include "shaders/shared/display.h"
#include "spirv/display.h"

namespace palpate {

namespace {

static_assert(kMaxEyeMarks == gpu::kMostMarks);
static_assert(static_cast<uint32_t>(StereoLayout::side_by_side) == gpu::kSideBySide &&
              static_cast<uint32_t>(StereoLayout::top_bottom) == gpu::kTopBottom &&
              static_cast<uint32_t>(StereoLayout::row_interleaved) == gpu::kRowInterleaved &&
              static_cast<uint32_t>(StereoLayout::column_interleaved) == gpu::kColumnInterleaved &&
              static_cast<uint32_t>(StereoLayout::checkerboard) == gpu::kCheckerboard &&
              static_cast<uint32_t>(StereoLayout::anaglyph) == gpu::kAnaglyph &&
              static_cast<uint32_t>(StereoLayout::left) == gpu::kLeftEye &&
              static_cast<uint32_t>(StereoLayout::right) == gpu::kRightEye);

} // namespace

DisplayPass::DisplayPass(GpuDevice& device)
    : device_(&device),
      pipeline_(device, spirv::Display{}),
      nearest_(device, SampleFilter::nearest, Edge::clamp) {}

GpuImage DisplayPass::make_target(GpuDevice& device, std::string name, glm::uvec2 size_px) {
    return {device,
            std::move(name),
            {.format = VK_FORMAT_R8G8B8A8_UNORM, .size = {size_px, 1}, .storage = true}};
}

void DisplayPass::record(Commands& commands, GpuImage& picture, const DisplayLayout& display,
                         const Target& target) {
    PALPATE_ASSERT(display.layout != StereoLayout::separate);
    const glm::uvec2 eye_px(picture.shape().size);
    const glm::uvec2 joint_px = display_size_px(eye_px, display.layout);
    const ImageShape& shape = target.image.shape();
    PALPATE_ASSERT(shape.format == VK_FORMAT_R8G8B8A8_UNORM && shape.storage);
    PALPATE_ASSERT(
        glm::all(glm::lessThanEqual(target.corner_px + joint_px, glm::uvec2(shape.size))));
    const PixelBox box = target.only.value_or(PixelBox{glm::uvec2(0), joint_px});
    PALPATE_ASSERT(!box.empty() && glm::all(glm::lessThanEqual(box.high, joint_px)));
    gpu::DisplayBlock block{.eye_px = eye_px,
                            .first_px = box.low,
                            .end_px = box.high,
                            .origin_px = display.origin_px,
                            .corner_px = target.corner_px,
                            .form = static_cast<uint32_t>(display.layout),
                            .last_eye = picture.shape().layers - 1,
                            .swap_eyes = display.swap_eyes,
                            .mirror = display.mirror,
                            .bgra = target.bgra,
                            .mark_count = static_cast<uint32_t>(display.marks.size())};
    PALPATE_ASSERT_CMP(display.marks.size(), <=, kMaxEyeMarks);
    std::transform(display.marks.begin(), display.marks.end(), std::begin(block.marks), mark_block);
    const Bound bound[] = {bind_uniform(gpu::kDisplayBlock, commands.upload(bytes_of(block))),
                           bind_sampled(gpu::kDisplayPicture, picture, nearest_),
                           bind_storage_image(gpu::kDisplayTarget, target.image)};
    if (!display.marks.empty() && !with_marks_)
        with_marks_.emplace(*device_, spirv::Display{.has_marks = true});
    commands.begin_pass("display");
    commands.dispatch(display.marks.empty() ? pipeline_ : *with_marks_, bound,
                      {(box.high - box.low + (gpu::kDisplayGroup - 1)) / gpu::kDisplayGroup, 1});
    commands.end_pass();
}

} // namespace palpate
