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

constexpr auto kUniform = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
constexpr auto kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
constexpr auto kSampled = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;

constexpr BindingSlot kCullSlots[] = {
    {gpu::kExtractFrame, kUniform}, {gpu::kExtractRanges, kStorage}, {gpu::kExtractSums, kStorage}};
constexpr BindingSlot kListSlots[] = {{gpu::kExtractFrame, kUniform},
                                      {gpu::kExtractRanges, kStorage},
                                      {gpu::kExtractSums, kStorage},
                                      {gpu::kExtractList, kStorage}};
constexpr BindingSlot kScanSlots[] = {{gpu::kExtractSums, kStorage}, {gpu::kExtractWork, kStorage}};
constexpr BindingSlot kCountSlots[] = {
    {gpu::kExtractFrame, kUniform},  {gpu::kExtractSamples, kSampled},
    {gpu::kExtractWork, kStorage},   {gpu::kExtractList, kStorage},
    {gpu::kExtractCounts, kStorage}, {gpu::kExtractCases, kStorage}};
constexpr BindingSlot kEmitSlots[] = {
    {gpu::kExtractFrame, kUniform},     {gpu::kExtractSamples, kSampled},
    {gpu::kExtractCases, kStorage},     {gpu::kExtractJobs, kStorage},
    {gpu::kExtractPositions, kStorage}, {gpu::kExtractNormals, kStorage},
    {gpu::kExtractTriangles, kStorage}, {gpu::kExtractEdges, kStorage}};
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
      cull_(device, "extract cull", spirv::extract_cull[0], kCullSlots),
      list_(device, "extract list", spirv::extract_cull[1], kListSlots),
      scan_(device, "extract scan", spirv::extract_scan[0], kScanSlots),
      count_(device, "extract count", spirv::extract_count[0], kCountSlots),
      cases_(device, "cases of cells", 256 * sizeof(gpu::ExtractCase), Memory::upload),
      nearest_(device, SampleFilter::nearest, Edge::clamp) {
    for (size_t i = 0; i < 256; ++i) {
        const gpu::ExtractCase entry = packed(classic_table(), i);
        std::memcpy(cases_.mapped().data() + i * sizeof entry, &entry, sizeof entry);
    }
}

ComputePipeline& ExtractPipelines::emit(bool normals) {
    std::optional<ComputePipeline>& pipeline = normals ? emit_ : emit_plain_;
    if (!pipeline) {
        const uint32_t constants[] = {normals};
        pipeline.emplace(*device_, normals ? "extract emit" : "extract emit plain",
                         spirv::extract_emit[0], kEmitSlots, constants);
    }
    return *pipeline;
}

} // namespace palpate
