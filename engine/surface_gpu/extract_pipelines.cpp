#include "engine/surface_gpu/extract_pipelines.h"

#include <cstring>

#include "engine/surface/cell_tables.h"
#include "shaders/shared/extract.h"
#include "spirv/extract_count.h"
#include "spirv/extract_cull.h"
#include "spirv/extract_emit.h"
#include "spirv/extract_scan.h"

namespace palpate {

namespace {

gpu::ExtractCase packed(const ClassicTable& table, size_t cell_case) {
    uint64_t bits = uint64_t{table.triangle_count[cell_case]} << 60;
    for (size_t i = 0; i < size_t{3} * table.triangle_count[cell_case]; ++i)
        bits |= uint64_t{table.edges[cell_case][i]} << (4 * i);
    return {static_cast<uint32_t>(bits), static_cast<uint32_t>(bits >> 32)};
}
static_assert(3 * ClassicTable::kMaxTriangles <= 15, "four bits each below the number");

} // namespace

ExtractPipelines::ExtractPipelines(GpuDevice& device)
    : device_(&device),
      pipelines_(device),
      cases_(device, "cases of cells", 256 * sizeof(gpu::ExtractCase), Memory::upload),
      nearest_(device, SampleFilter::nearest, Edge::clamp) {
    for (size_t i = 0; i < 256; ++i) {
        const gpu::ExtractCase entry = packed(classic_table(), i);
        std::memcpy(cases_.mapped().data() + i * sizeof entry, &entry, sizeof entry);
    }
}

ComputePipeline& ExtractPipelines::cull(bool list) {
    return pipelines_.get(spirv::ExtractCull{.is_list = list});
}

ComputePipeline& ExtractPipelines::scan() {
    return pipelines_.get(spirv::ExtractScan{});
}

ComputePipeline& ExtractPipelines::count() {
    return pipelines_.get(spirv::ExtractCount{});
}

ComputePipeline& ExtractPipelines::emit(bool normals) {
    return pipelines_.get(spirv::ExtractEmit{.normals = normals});
}

} // namespace palpate
