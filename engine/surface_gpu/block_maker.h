#pragma once

namespace palpate {

// Who makes the blocks of a surface that is kept on the device: GpuSurface.
enum class BlockMaker { device, cpu };

} // namespace palpate
