#include "engine/surface_gpu/gpu_surface.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "engine/base/assert.h"
#include "engine/surface/block_changes.h"
#include "engine/surface/block_join.h"
#include "engine/surface/block_reader.h"

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

uint64_t product(glm::ivec3 v) {
    return static_cast<uint64_t>(v.x) * static_cast<uint64_t>(v.y) * static_cast<uint64_t>(v.z);
}

glm::ivec3 blocks_of(const Volume& volume, bool closed) {
    const int lead = closed ? 1 : 0;
    return (glm::ivec3(volume.size()) - 1 + lead) / block::kSide + 1 + lead;
}

template <class T>
std::span<const T> mapped(const Buffer& buffer) {
    return {reinterpret_cast<const T*>(buffer.mapped().data()), buffer.bytes() / sizeof(T)};
}

// A count, and so many entries after it.
template <class T>
void write_counted(Buffer& buffer, const std::vector<T>& entries) {
    const auto count = static_cast<uint32_t>(entries.size());
    std::memcpy(buffer.mapped().data(), &count, sizeof count);
    std::memcpy(buffer.mapped().data() + sizeof count, entries.data(), entries.size() * sizeof(T));
}

} // namespace

Result<void> GpuSurface::supports(const GpuDevice& device, const Volume& volume,
                                  const SurfaceOptions& options) {
    if (options.topology != SurfaceTopology::classic)
        return fail("surfaces on a graphics device: expected the topology classic, found correct");
    const uint64_t most = device.limits().maxStorageBufferRange / sizeof(gpu::ExtractCount);
    const glm::ivec3 blocks = blocks_of(volume, options.closed_at_border);
    if (product(blocks) > most)
        return fail("{}: expected at most {} blocks of 8^3 samples, found {}", device.info().name,
                    most, product(blocks));
    return SampleImage::fits(device, volume);
}

GpuSurface::GpuSurface(ExtractPipelines& pipelines, const Volume& volume, float iso,
                       const SurfaceOptions& options)
    : pipelines_(&pipelines),
      device_(&pipelines.device()),
      volume_(volume),
      iso_(iso),
      options_(options),
      lead_(options.closed_at_border ? 1 : 0),
      count_(blocks_of(volume, options.closed_at_border)),
      samples_(*device_, volume),
      pool_(*device_, options.normals == SurfaceNormals::gradient),
      record_of_(product(count_)),
      frame_(*device_, "extraction", sizeof(gpu::ExtractFrame), Memory::upload),
      work_(*device_, "blocks listed", sizeof(gpu::ExtractWork), Memory::device) {
    PALPATE_ASSERT(options.topology == SurfaceTopology::classic);
    hold_frame();
    extract_all();
}

void GpuSurface::set_iso(float iso) {
    iso_ = iso;
    hold_frame();
    extract_all();
}

void GpuSurface::hold_frame() {
    gpu::ExtractFrame frame{};
    frame.size = glm::ivec3(volume_.size());
    frame.last = frame.size - 1 + lead_;
    frame.blocks = glm::uvec3(count_);
    frame.lead = static_cast<uint32_t>(lead_);
    frame.closed = options_.closed_at_border ? 1 : 0;
    frame.is_float = samples_.is_float() ? 1 : 0;
    frame.bias = samples_.bias();
    frame.iso_order = iso_order(iso_);
    frame.iso = iso_;
    frame.spacing_mm = glm::vec3(spacing_mm(volume_.grid()));
    frame.normal_scale = 0.5f / frame.spacing_mm;
    std::memcpy(frame_.mapped().data(), &frame, sizeof frame);
}

uint32_t GpuSurface::number_of(glm::ivec3 block) const {
    const glm::ivec3 at = block + lead_;
    return static_cast<uint32_t>(at.x + count_.x * (at.y + count_.y * at.z));
}

glm::ivec3 GpuSurface::block_at(uint32_t number) const {
    const auto n = static_cast<int>(number);
    return glm::ivec3(n % count_.x, n / count_.x % count_.y, n / (count_.x * count_.y)) - lead_;
}

Buffer& GpuSurface::kept(std::optional<Buffer>& buffer, const char* name, uint64_t bytes,
                         Memory memory) {
    if (!buffer || buffer->bytes() < bytes)
        buffer.emplace(*device_, name, std::bit_ceil(bytes), memory);
    return *buffer;
}

void GpuSurface::finish(Commands& commands) {
    commands.submit();
    for (PassTime& time : commands.finish())
        times_.push_back(std::move(time));
}

void GpuSurface::extract_all() {
    times_.clear();
    pool_.clear();
    std::fill(record_of_.begin(), record_of_.end(), 0u);
    records_.clear();
    free_records_.clear();
    triangles_ = 0;

    const glm::ivec3 in_volume = (glm::ivec3(volume_.size()) + block::kSide - 1) / block::kSide;
    Buffer ranges(*device_, "ranges of blocks", product(in_volume) * sizeof(gpu::ExtractRange),
                  Memory::upload);
    auto* range = reinterpret_cast<gpu::ExtractRange*>(ranges.mapped().data());
    constexpr int kBlocks = static_cast<int>(kBlocksPerSide);
    tbb::parallel_for(0, in_volume.z, [&](int z) {
        for (int y = 0; y < in_volume.y; ++y)
            for (int x = 0; x < in_volume.x; ++x) {
                const glm::ivec3 at(x, y, z);
                range[static_cast<size_t>(x) +
                      static_cast<size_t>(in_volume.x) *
                          (static_cast<size_t>(y) +
                           static_cast<size_t>(in_volume.y) * static_cast<size_t>(z))] =
                    range_of(volume_.brick(glm::uvec3(at / kBlocks)),
                             block_of(glm::uvec3(at % kBlocks * block::kSide)));
            }
    });
    const uint64_t blocks = product(count_);
    const uint64_t groups = (blocks + gpu::kExtractGroup - 1) / gpu::kExtractGroup;
    Buffer sums(*device_, "blocks of groups", groups * sizeof(uint32_t), Memory::device);
    Buffer list(*device_, "list of blocks", blocks * sizeof(uint32_t), Memory::device);
    Buffer listed(*device_, "list to read", list.bytes(), Memory::read_back);
    Buffer work(*device_, "length of the list", work_.bytes(), Memory::read_back);
    Buffer counts(*device_, "counts of blocks", blocks * sizeof(gpu::ExtractCount),
                  Memory::read_back);

    Commands commands(*device_);
    commands.begin_pass("cull");
    const Bound cull[] = {bind_uniform(gpu::kExtractFrame, frame_),
                          bind_storage(gpu::kExtractRanges, ranges),
                          bind_storage(gpu::kExtractSums, sums, Use::storage_write)};
    commands.dispatch(pipelines_->cull(false), cull, groups_for(groups));
    const Bound scan[] = {bind_storage(gpu::kExtractSums, sums, Use::storage_write),
                          bind_storage(gpu::kExtractWork, work_, Use::storage_write)};
    commands.dispatch(pipelines_->scan(), scan, glm::uvec3(1));
    const Bound fill_list[] = {bind_uniform(gpu::kExtractFrame, frame_),
                               bind_storage(gpu::kExtractRanges, ranges),
                               bind_storage(gpu::kExtractSums, sums),
                               bind_storage(gpu::kExtractList, list, Use::storage_write)};
    commands.dispatch(pipelines_->cull(true), fill_list, groups_for(groups));
    commands.end_pass();
    const Bound count[] = {
        bind_uniform(gpu::kExtractFrame, frame_),
        bind_sampled(gpu::kExtractSamples, samples_.image(), pipelines_->nearest()),
        bind_storage(gpu::kExtractWork, work_),
        bind_storage(gpu::kExtractList, list),
        bind_storage(gpu::kExtractCounts, counts, Use::storage_write),
        bind_storage(gpu::kExtractCases, pipelines_->cases())};
    commands.begin_pass("count");
    commands.dispatch_indirect(pipelines_->count(), count, work_);
    commands.use(counts, Use::host_read);
    commands.end_pass();
    commands.copy(list, listed);
    commands.copy(work_, work);
    finish(commands);

    const uint32_t found = mapped<gpu::ExtractWork>(work)[0].listed;
    Commands making(*device_);
    record_blocks(making, mapped<uint32_t>(listed).first(found),
                  mapped<gpu::ExtractCount>(counts).first(found));
    finish(making);
}

// Gives the blocks' old ranges back, finds new ones, and has them made. Returns their triangles.
uint64_t GpuSurface::record_blocks(Commands& commands, std::span<const uint32_t> numbers,
                                   std::span<const gpu::ExtractCount> counts) {
    SurfacePool::Size still{};
    for (size_t i = 0; i < numbers.size(); ++i) {
        if (uint32_t& record = record_of_[numbers[i]]; record != 0) {
            Record& old = records_[record - 1];
            triangles_ -= old.range.triangles;
            pool_.give(old.range);
            old.range = {};
            free_records_.push_back(record - 1);
            record = 0;
        }
        const SurfacePool::Size size = SurfacePool::rounded(
            {(counts[i].vertices & 0xffff) + (counts[i].vertices >> 16), counts[i].triangles});
        still.vertices += size.vertices;
        still.triangles += size.triangles;
    }
    uint64_t triangles = 0;
    for (size_t i = 0; i < numbers.size(); ++i) {
        const uint32_t own = counts[i].vertices & 0xffff;
        const uint32_t vertices = own + (counts[i].vertices >> 16);
        if (vertices == 0)
            continue;
        if (free_records_.empty()) {
            free_records_.push_back(static_cast<uint32_t>(records_.size()));
            records_.emplace_back();
        }
        const uint32_t record = free_records_.back();
        free_records_.pop_back();
        records_[record] = {numbers[i], own,
                            pool_.take(numbers[i], vertices, counts[i].triangles, still)};
        record_of_[numbers[i]] = record + 1;
        const SurfacePool::Size size = SurfacePool::rounded({vertices, counts[i].triangles});
        still.vertices -= size.vertices;
        still.triangles -= size.triangles;
        triangles += counts[i].triangles;
    }
    triangles_ += triangles;

    const bool normals = options_.normals == SurfaceNormals::gradient;
    std::deque<SurfacePool::Arena>& arenas = pool_.arenas();
    jobs_.resize(arenas.size());
    changes_.resize(arenas.size());
    commands.begin_pass("emit");
    for (size_t i = 0; i < arenas.size(); ++i) {
        SurfacePool::Arena& arena = arenas[i];
        if (!arena.jobs.empty()) {
            Buffer& jobs = kept(jobs_[i], "blocks to make",
                                sizeof(uint32_t) + arena.jobs.size() * sizeof(gpu::ExtractJob),
                                Memory::upload);
            write_counted(jobs, arena.jobs);
            Buffer& to_normals = arena.normals ? *arena.normals : arena.positions; // not written
            const Bound bound[] = {
                bind_uniform(gpu::kExtractFrame, frame_),
                bind_sampled(gpu::kExtractSamples, samples_.image(), pipelines_->nearest()),
                bind_storage(gpu::kExtractCases, pipelines_->cases()),
                bind_storage(gpu::kExtractJobs, jobs),
                bind_storage(gpu::kExtractPositions, arena.positions, Use::storage_write),
                bind_storage(gpu::kExtractNormals, to_normals, Use::storage_write),
                bind_storage(gpu::kExtractTriangles, arena.triangles, Use::storage_write),
                bind_storage(gpu::kExtractEdges, arena.edges, Use::storage_write)};
            commands.dispatch(pipelines_->emit(normals), bound, groups_for(arena.jobs.size()));
            arena.jobs.clear();
        }
        if (!arena.changed_draws.empty()) {
            constexpr uint64_t kBytes = sizeof(gpu::ExtractDraw);
            Buffer& buffer = kept(changes_[i], "draws that change",
                                  arena.changed_draws.size() * kBytes, Memory::upload);
            std::vector<Commands::Bytes> pieces; // draws side by side are one
            uint64_t at = 0;
            for (const auto& [slot, draw] : arena.changed_draws) {
                std::memcpy(buffer.mapped().data() + at, &draw, kBytes);
                if (!pieces.empty() && pieces.back().to + pieces.back().count == slot * kBytes)
                    pieces.back().count += kBytes;
                else
                    pieces.push_back({at, slot * kBytes, kBytes});
                at += kBytes;
            }
            commands.copy(buffer, arena.draws, pieces);
            arena.changed_draws.clear();
        }
    }
    commands.end_pass();
    return triangles;
}

GpuSurface::Update GpuSurface::update(const Volume& after) {
    return update(after, changed_bricks(volume_, after));
}

GpuSurface::Update GpuSurface::update(const Volume& after, std::span<const ChangedBrick> changed) {
    PALPATE_ASSERT(after.size() == volume_.size() && after.type() == volume_.type());
    times_.clear();
    Update done;
    if (changed.empty()) {
        volume_ = after;
        return done;
    }
    done.blocks = block::blocks_that_read(volume_, after, changed, options_, glm::ivec3(-lead_),
                                          count_ - lead_);
    volume_ = after;
    // Blocks on one side of iso are not made; what they held goes.
    std::vector<uint32_t> numbers, emptied;
    for (const glm::ivec3& b : done.blocks) {
        const bool empty = lead_ == 0 && block::is_on_one_side(after, iso_, b);
        (empty ? emptied : numbers).push_back(number_of(b));
    }
    std::vector<gpu::ExtractCount> counts = counted(numbers);
    numbers.insert(numbers.end(), emptied.begin(), emptied.end());
    counts.resize(numbers.size());
    Commands commands(*device_);
    samples_.bring_changes(commands, after, changed);
    done.triangles = record_blocks(commands, numbers, counts);
    finish(commands);
    return done;
}

// What blocks of volume_ hold, counted here: the samples lie here too, and an answer of the device,
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

const PoolRange* GpuSurface::range(glm::ivec3 block) const {
    const glm::ivec3 at = block + lead_;
    if (glm::any(glm::lessThan(at, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(at, count_)))
        return nullptr;
    const uint32_t record = record_of_[number_of(block)];
    return record == 0 ? nullptr : &records_[record - 1].range;
}

std::vector<glm::ivec3> GpuSurface::blocks() const {
    std::vector<glm::ivec3> found;
    for (const Record& r : records_)
        if (r.range.vertices > 0)
            found.push_back(block_at(r.block));
    std::sort(found.begin(), found.end(), block::comes_before);
    return found;
}

std::vector<BlockMesh> GpuSurface::read_back() {
    struct Copy {
        Buffer positions, normals, edges, triangles;
    };
    std::deque<Copy> copies;
    Commands commands(*device_);
    for (SurfacePool::Arena& arena : pool_.arenas()) {
        const auto buffer = [&](const Buffer& of) {
            return Buffer(*device_, "surface to read", of.bytes(), Memory::read_back);
        };
        Buffer& normals = arena.normals ? *arena.normals : arena.edges; // not read
        copies.push_back({buffer(arena.positions), buffer(normals), buffer(arena.edges),
                          buffer(arena.triangles)});
        commands.copy(arena.positions, copies.back().positions);
        commands.copy(normals, copies.back().normals);
        commands.copy(arena.edges, copies.back().edges);
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
        for (const uint32_t edge :
             mapped<uint32_t>(from.edges).subspan(range.first_vertex, range.vertices))
            mesh.edges.push_back(static_cast<uint16_t>(edge));
        mesh.own_edges = record.own;
    });
    return meshes;
}

Mesh GpuSurface::mesh() {
    const std::vector<glm::ivec3> order = blocks();
    const std::vector<BlockMesh> meshes = read_back();
    std::vector<block::PlacedBlock> placed;
    for (size_t i = 0; i < order.size(); ++i)
        placed.push_back({order[i], &meshes[i]});
    return block::join_blocks(volume_.grid(), options_, placed);
}

} // namespace palpate
