#include "engine/render/transfer_image.h"

#include <cmath>

#include "shaders/shared/ray_cast.h"

namespace palpate {

static_assert(kTransferTableSize == gpu::kTableEntries);

TransferImage::TransferImage(GpuDevice& device, std::string name)
    : image_(device, std::move(name),
             {.type = VK_IMAGE_TYPE_1D,
              .format = VK_FORMAT_R32G32B32A32_SFLOAT,
              .size = {gpu::kTableEntries, 1, 1},
              .layers = gpu::kTableRows}) {}

void TransferImage::hold(const TransferFunction& function, double step_mm, Commands& commands) {
    if (is_for(function, step_mm))
        return;
    function_ = function;
    step_mm_ = step_mm;
    const TransferTable table = make_table(function);
    low_ = table.low;
    high_ = table.high;
    first_ = table.entries.front();
    last_ = table.entries.back();
    std::vector<glm::vec4> texels(size_t{gpu::kTableRows} * gpu::kTableEntries);
    float visible = 0.0f;
    for (size_t i = 0; i < gpu::kTableEntries; ++i) {
        const glm::vec4 entry = table.entries[i];
        // From tau in double: an opacity of 1e-7 keeps all its digits.
        const double value = low_ + (high_ - low_) * static_cast<double>(i) /
                                        static_cast<double>(gpu::kTableEntries - 1);
        const double alpha = -std::expm1(-tau_per_mm_at(function, value) * step_mm);
        texels[gpu::kTableRowStep * gpu::kTableEntries + i] =
            glm::vec4(glm::vec3(entry.x, entry.y, entry.z), static_cast<float>(alpha));
        texels[gpu::kTableRowTau * gpu::kTableEntries + i] = entry;
        const float below = visible;
        visible += entry.w > 0.0f ? 1.0f : 0.0f;
        texels[gpu::kTableRowVisible * gpu::kTableEntries + i] = glm::vec4(visible, below, 0, 0);
        visible += shows_after(table, i) ? 1.0f : 0.0f;
        // In units of one entry's width.
        texels[gpu::kTableRowIntegral * gpu::kTableEntries + i] =
            table.integrals[i] * static_cast<float>(gpu::kTableEntries - 1);
    }
    const Commands::Region region{.buffer_offset = 0,
                                  .image_offset = {},
                                  .size = image_.shape().size,
                                  .layers = gpu::kTableRows};
    commands.copy(commands.upload(std::as_bytes(std::span(texels))), image_, std::span(&region, 1));
}

} // namespace palpate
