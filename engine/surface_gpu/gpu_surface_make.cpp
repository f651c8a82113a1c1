// How a GpuSurface's blocks are made: found, counted and emitted by the device, or made by the CPU
// and uploaded; and read back.

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "engine/base/assert.h"
#include "engine/surface/block_reader.h"
#include "engine/surface_gpu/gpu_surface.h"

namespace palpate {

namespace {

constexpr size_t kAtOnce = 32; // blocks that are counted sooner than threads wake up
constexpr int kOrderLowest = std::numeric_limits<int>::min();
constexpr int kOrderHighest = std::numeric_limits<int>::max();

// As sample_order() in shaders/lib/extract_frame.glsl.
int order_of(float value) {
    const auto bits = std::bit_cast<int32_t>(value);
    return bits ^ ((bits >> 31) & 0x7fffffff);
}

// The least order that is inside. -0 equals 0, and nothing reaches NaN.
int iso_order(float iso) {
    if (iso != iso)
        return kOrderHighest;
    return order_of(iso == 0.0f ? -0.0f : iso);
}

gpu::ExtractRange range_of(const Brick& brick, uint32_t block) {
    const ValueRange range = brick.block_range(block);
    if (range.empty())
        return {kOrderHighest, kOrderLowest};
    // Ranges may hold either zero for both.
    return {
        brick.no_data_count() > 0 ? kOrderLowest : order_of(range.min == 0.0f ? -0.0f : range.min),
        order_of(range.max == 0.0f ? 0.0f : range.max)};
}

glm::uvec3 groups_for(uint64_t items) {
    const auto most = uint64_t{gpu::kExtractMostGroups};
    return {std::min(items, most), (items + most - 1) / most, 1};
}

template <class T>
std::span<const T> mapped(const Buffer& buffer) {
    return {reinterpret_cast<const T*>(buffer.mapped().data()), buffer.bytes() / sizeof(T)};
}

// A count, and so many entries after it.
template <class T>
BufferSlice upload_counted(Commands& commands, const std::vector<T>& entries) {
    const BufferSlice slice = commands.staging(sizeof(uint32_t) + entries.size() * sizeof(T));
    const auto count = static_cast<uint32_t>(entries.size());
    std::memcpy(slice.mapped().data(), &count, sizeof count);
    std::memcpy(slice.mapped().data() + sizeof count, entries.data(), entries.size() * sizeof(T));
    return slice;
}

} // namespace

void GpuSurface::hold_frame() {
    gpu::ExtractFrame& frame = frame_;
    frame.size = glm::ivec3(volume_.size());
    frame.last = frame.size - 1 + lead_;
    frame.blocks = glm::uvec3(count_);
    frame.lead = static_cast<uint32_t>(lead_);
    frame.closed = options_.closed_at_border ? 1 : 0;
    frame.is_float = samples_->is_float() ? 1 : 0;
    frame.bias = samples_->bias();
    frame.iso_order = iso_order(iso_);
    frame.iso = iso_;
    frame.spacing_mm = glm::vec3(spacing_mm(volume_.grid()));
    frame.normal_scale = 0.5f / frame.spacing_mm;
}

void GpuSurface::extract_on_cpu() {
    cpu_.emplace(volume_, iso_, options_);
    std::vector<uint32_t> numbers;
    for (const glm::ivec3& block : cpu_->blocks())
        numbers.push_back(number_of(block));
    Commands commands(*device_);
    pool_.clear(commands);
    find_room(commands, numbers, made(numbers));
    upload_made(commands, /*all=*/true);
    finish(commands);
}

void GpuSurface::extract_on_device() {
    hold_frame();
    const glm::uvec3 in_volume = (volume_.size() + kBlockSide - 1u) / kBlockSide;
    Buffer ranges(*device_, "ranges of blocks",
                  size_t{in_volume.x} * in_volume.y * in_volume.z * sizeof(gpu::ExtractRange),
                  Memory::upload);
    auto* range = reinterpret_cast<gpu::ExtractRange*>(ranges.mapped().data());
    tbb::parallel_for(0u, in_volume.z, [&](uint32_t z) {
        for (uint32_t y = 0; y < in_volume.y; ++y)
            for (uint32_t x = 0; x < in_volume.x; ++x) {
                const glm::uvec3 at(x, y, z);
                range[x + in_volume.x * (y + size_t{in_volume.y} * z)] = range_of(
                    volume_.brick(at / kBlocksPerSide), block_of(at % kBlocksPerSide * kBlockSide));
            }
    });
    const uint64_t blocks = record_of_.size();
    const uint64_t groups = (blocks + gpu::kExtractGroup - 1) / gpu::kExtractGroup;
    Buffer sums(*device_, "blocks of groups", groups * sizeof(uint32_t), Memory::device);
    Buffer list(*device_, "list of blocks", blocks * sizeof(uint32_t), Memory::device);
    Buffer listed(*device_, "list to read", list.bytes(), Memory::read_back);
    Buffer to_do(*device_, "blocks listed", sizeof(gpu::ExtractWork), Memory::device);
    Buffer work(*device_, "length of the list", to_do.bytes(), Memory::read_back);
    Buffer counts(*device_, "counts of blocks", blocks * sizeof(gpu::ExtractCount),
                  Memory::read_back);

    Commands commands(*device_);
    const BufferSlice frame = commands.upload(bytes_of(frame_));
    commands.begin_pass("cull");
    const Bound cull[] = {bind_uniform(gpu::kExtractFrame, frame),
                          bind_storage(gpu::kExtractRanges, ranges),
                          bind_storage(gpu::kExtractSums, sums, Use::storage_write)};
    commands.dispatch(pipelines_->cull(false), cull, groups_for(groups));
    const Bound scan[] = {bind_storage(gpu::kExtractSums, sums, Use::storage_write),
                          bind_storage(gpu::kExtractWork, to_do, Use::storage_write)};
    commands.dispatch(pipelines_->scan(), scan, glm::uvec3(1));
    const Bound fill_list[] = {bind_uniform(gpu::kExtractFrame, frame),
                               bind_storage(gpu::kExtractRanges, ranges),
                               bind_storage(gpu::kExtractSums, sums),
                               bind_storage(gpu::kExtractList, list, Use::storage_write)};
    commands.dispatch(pipelines_->cull(true), fill_list, groups_for(groups));
    commands.end_pass();
    const Bound count[] = {
        bind_uniform(gpu::kExtractFrame, frame),
        bind_sampled(gpu::kExtractSamples, samples_->image(), pipelines_->nearest()),
        bind_storage(gpu::kExtractWork, to_do),
        bind_storage(gpu::kExtractList, list),
        bind_storage(gpu::kExtractCounts, counts, Use::storage_write),
        bind_storage(gpu::kExtractCases, pipelines_->cases())};
    commands.begin_pass("count");
    commands.dispatch_indirect(pipelines_->count(), count, to_do);
    commands.use(counts, Use::host_read);
    commands.end_pass();
    commands.copy(list, listed);
    commands.copy(to_do, work);
    finish(commands);

    const uint32_t found = mapped<gpu::ExtractWork>(work)[0].listed;
    Commands making(*device_);
    pool_.clear(making);
    find_room(making, mapped<uint32_t>(listed).first(found),
              mapped<gpu::ExtractCount>(counts).first(found));
    record_emit(making);
    finish(making);
}

void GpuSurface::record_emit(Commands& commands) {
    const bool normals = options_.normals == SurfaceNormals::gradient;
    const BufferSlice frame = commands.upload(bytes_of(frame_));
    commands.begin_pass("emit");
    for (SurfacePool::Arena& arena : pool_.arenas()) {
        if (arena.jobs.empty())
            continue;
        Buffer& to_normals = arena.normals ? *arena.normals : arena.positions; // not written
        const Bound bound[] = {
            bind_uniform(gpu::kExtractFrame, frame),
            bind_sampled(gpu::kExtractSamples, samples_->image(), pipelines_->nearest()),
            bind_storage(gpu::kExtractCases, pipelines_->cases()),
            bind_storage(gpu::kExtractJobs, upload_counted(commands, arena.jobs)),
            bind_storage(gpu::kExtractPositions, arena.positions, Use::storage_write),
            bind_storage(gpu::kExtractNormals, to_normals, Use::storage_write),
            bind_storage(gpu::kExtractTriangles, arena.triangles, Use::storage_write),
            bind_storage(gpu::kExtractEdges, *arena.edges, Use::storage_write)};
        commands.dispatch(pipelines_->emit(normals), bound, groups_for(arena.jobs.size()));
        arena.jobs.clear();
    }
    commands.end_pass();
}

// Uploads what the CPU made to the ranges found for it; `all`: the pool holds nothing else.
void GpuSurface::upload_made(Commands& commands, bool all) {
    for (SurfacePool::Arena& arena : pool_.arenas()) {
        std::vector<std::vector<glm::uvec3>> triangles; // of the arena's vertices
        for (const gpu::ExtractJob& job : arena.jobs) {
            triangles.push_back(cpu_->block(block_at(job.block))->triangles);
            for (glm::uvec3& t : triangles.back())
                t += job.first_vertex;
        }
        const auto bring = [&](Buffer& to, auto first_of, auto items_of) {
            constexpr uint64_t kBytes = sizeof(glm::vec3);
            static_assert(kBytes == sizeof(glm::uvec3));
            std::vector<UploadPiece> pieces;
            uint64_t end = 0;
            for (size_t i = 0; i < arena.jobs.size(); ++i) {
                pieces.push_back(
                    {std::as_bytes(std::span(items_of(i))), first_of(arena.jobs[i]) * kBytes});
                end = std::max(end, pieces.back().to + pieces.back().bytes.size());
            }
            std::vector<std::byte> whole;
            if (all) {
                whole.resize(end);
                for (const UploadPiece& piece : pieces)
                    std::ranges::copy(piece.bytes,
                                      whole.begin() + static_cast<std::ptrdiff_t>(piece.to));
                pieces = {{whole, 0}};
            }
            upload_pieces(commands, pieces, to);
        };
        const auto mesh = [&](size_t i) -> const BlockMesh& {
            return *cpu_->block(block_at(arena.jobs[i].block));
        };
        const auto vertex = [](const gpu::ExtractJob& job) { return job.first_vertex; };
        bring(arena.positions, vertex, [&](size_t i) { return std::span(mesh(i).positions); });
        if (arena.normals)
            bring(*arena.normals, vertex, [&](size_t i) { return std::span(mesh(i).normals); });
        bring(
            arena.triangles, [](const gpu::ExtractJob& job) { return job.first_triangle; },
            [&](size_t i) { return std::span(std::as_const(triangles[i])); });
        arena.jobs.clear();
    }
}

// Counts of the blocks that cpu_ made; those without a surface hold nothing.
std::vector<gpu::ExtractCount> GpuSurface::made(std::span<const uint32_t> numbers) const {
    std::vector<gpu::ExtractCount> counts;
    for (const uint32_t number : numbers) {
        const BlockMesh* mesh = cpu_->block(block_at(number));
        const auto vertices = static_cast<uint32_t>(mesh ? mesh->positions.size() : 0);
        const uint32_t own = mesh ? mesh->own_edges : 0;
        counts.push_back({own | (vertices - own) << 16,
                          static_cast<uint32_t>(mesh ? mesh->triangles.size() : 0)});
    }
    return counts;
}

// Counts of blocks of volume_, counted here: the samples lie here too, and an answer of the device,
// for which all else had to wait, takes longer than to count some hundred blocks.
std::vector<gpu::ExtractCount> GpuSurface::counted(std::span<const uint32_t> numbers) {
    std::vector<gpu::ExtractCount> counts(numbers.size());
    const glm::ivec3 last = glm::ivec3(volume_.size()) - 1 + lead_;
    const auto count = [&](size_t first, size_t end, block::BlockCounter& counter) {
        block::BlockReader reader(volume_, options_.closed_at_border);
        for (size_t i = first; i < end; ++i) {
            const glm::ivec3 at = block_at(numbers[i]);
            reader.read(at, counter.samples());
            const auto found =
                counter.count(glm::min(last - at * block::kSide, glm::ivec3(9)), iso_);
            counts[i] = {found.own_edges | found.borrowed << 16, found.triangles};
        }
    };
    if (numbers.size() <= kAtOnce)
        count(0, numbers.size(), counter_);
    else
        tbb::parallel_for(tbb::blocked_range<size_t>(0, numbers.size(), kAtOnce),
                          [&](const tbb::blocked_range<size_t>& range) {
                              block::BlockCounter counter;
                              count(range.begin(), range.end(), counter);
                          });
    return counts;
}

std::vector<BlockMesh> GpuSurface::read_back() {
    PALPATE_ASSERT(!cpu_);
    struct Copy {
        Buffer positions, normals, edges, triangles;
    };
    std::deque<Copy> copies;
    Commands commands(*device_);
    for (SurfacePool::Arena& arena : pool_.arenas()) {
        const auto buffer = [&](const Buffer& of) {
            return Buffer(*device_, "surface to read", of.bytes(), Memory::read_back);
        };
        Buffer& normals = arena.normals ? *arena.normals : *arena.edges; // not read
        copies.push_back({buffer(arena.positions), buffer(normals), buffer(*arena.edges),
                          buffer(arena.triangles)});
        commands.copy(arena.positions, copies.back().positions);
        commands.copy(normals, copies.back().normals);
        commands.copy(*arena.edges, copies.back().edges);
        commands.copy(arena.triangles, copies.back().triangles);
    }
    commands.submit();
    commands.finish();

    const std::vector<glm::ivec3> order = blocks();
    std::vector<BlockMesh> meshes(order.size());
    tbb::parallel_for(size_t{0}, order.size(), [&](size_t i) {
        const Record& record = records_[record_of_[number_of(order[i])] - 1];
        const PoolRange& range = record.range;
        const Copy& from = copies[range.arena];
        BlockMesh& mesh = meshes[i];
        const auto take = [](auto& to, const auto& source, size_t first, size_t count) {
            to.assign(source.begin() + static_cast<std::ptrdiff_t>(first),
                      source.begin() + static_cast<std::ptrdiff_t>(first + count));
        };
        take(mesh.positions, mapped<glm::vec3>(from.positions), range.first_vertex, range.vertices);
        if (options_.normals == SurfaceNormals::gradient)
            take(mesh.normals, mapped<glm::vec3>(from.normals), range.first_vertex, range.vertices);
        take(mesh.triangles, mapped<glm::uvec3>(from.triangles), range.first_triangle,
             range.triangles);
        for (glm::uvec3& triangle : mesh.triangles) // from the block's first one on
            triangle -= range.first_vertex;
        for (const uint32_t edge :
             mapped<uint32_t>(from.edges).subspan(range.first_vertex, range.vertices))
            mesh.edges.push_back(static_cast<uint16_t>(edge));
        mesh.own_edges = record.own;
    });
    return meshes;
}

} // namespace palpate
