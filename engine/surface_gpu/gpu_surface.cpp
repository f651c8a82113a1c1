#include "engine/surface_gpu/gpu_surface.h"

#include <algorithm>

#include "engine/base/assert.h"
#include "engine/surface/block_changes.h"
#include "engine/surface/block_join.h"

namespace palpate {

namespace {

uint64_t product(glm::ivec3 v) {
    return static_cast<uint64_t>(v.x) * static_cast<uint64_t>(v.y) * static_cast<uint64_t>(v.z);
}

glm::ivec3 blocks_of(const Volume& volume, bool closed) {
    const int lead = closed ? 1 : 0;
    return (glm::ivec3(volume.size()) - 1 + lead) / block::kSide + 1 + lead;
}

} // namespace

Result<void> GpuSurface::supports(const GpuDevice& device, const Volume& volume,
                                  const SurfaceOptions& options, BlockMaker maker) {
    if (options.topology != SurfaceTopology::classic && maker == BlockMaker::device)
        return fail("surfaces on a graphics device: expected the topology classic, found correct");
    const uint64_t most = device.limits().maxStorageBufferRange / sizeof(gpu::ExtractCount);
    const glm::ivec3 blocks = blocks_of(volume, options.closed_at_border);
    if (product(blocks) > most)
        return fail("{}: expected at most {} blocks of 8^3 samples, found {}", device.info().name,
                    most, product(blocks));
    return maker == BlockMaker::device ? SampleImage::fits(device, volume) : Result<void>{};
}

GpuSurface::GpuSurface(ExtractPipelines& pipelines, const Volume& volume, float iso,
                       const SurfaceOptions& options, BlockMaker maker)
    : pipelines_(&pipelines),
      device_(&pipelines.device()),
      volume_(volume),
      iso_(iso),
      options_(options),
      lead_(options.closed_at_border ? 1 : 0),
      count_(blocks_of(volume, options.closed_at_border)),
      pool_(*device_, options.normals == SurfaceNormals::gradient, maker == BlockMaker::device),
      record_of_(product(count_)) {
    PALPATE_ASSERT(maker == BlockMaker::cpu || options.topology == SurfaceTopology::classic);
    if (maker == BlockMaker::device)
        samples_.emplace(*device_, volume);
    extract_all();
}

void GpuSurface::set_iso(float iso) {
    iso_ = iso;
    extract_all();
}

uint32_t GpuSurface::number_of(glm::ivec3 block) const {
    const glm::ivec3 at = block + lead_;
    return static_cast<uint32_t>(at.x + count_.x * (at.y + count_.y * at.z));
}

glm::ivec3 GpuSurface::block_at(uint32_t number) const {
    const auto n = static_cast<int>(number);
    return glm::ivec3(n % count_.x, n / count_.x % count_.y, n / (count_.x * count_.y)) - lead_;
}

void GpuSurface::finish(Commands& commands) {
    commands.submit();
    for (PassTime& time : commands.finish())
        times_.push_back(std::move(time));
}

void GpuSurface::extract_all() {
    times_.clear();
    std::fill(record_of_.begin(), record_of_.end(), 0u);
    records_.clear();
    free_records_.clear();
    triangles_ = 0;
    if (samples_)
        extract_on_device();
    else
        extract_on_cpu();
}

// Gives the blocks' old ranges back and finds new ones, in which they are then to be made. Returns
// their triangles.
uint64_t GpuSurface::find_room(Commands& commands, std::span<const uint32_t> numbers,
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
                            pool_.take(numbers[i], vertices, counts[i].triangles, still, commands)};
        record_of_[numbers[i]] = record + 1;
        const SurfacePool::Size size = SurfacePool::rounded({vertices, counts[i].triangles});
        still.vertices -= size.vertices;
        still.triangles -= size.triangles;
        triangles += counts[i].triangles;
    }
    triangles_ += triangles;
    pool_.erase_given(commands);
    return triangles;
}

GpuSurface::Update GpuSurface::update(const Volume& after) {
    return update(after, changed_bricks(volume_, after));
}

GpuSurface::Update GpuSurface::update(const Volume& after, std::span<const ChangedBrick> changed) {
    times_.clear();
    Commands commands(*device_);
    Update done = record_update(commands, after, changed);
    if (!done.blocks.empty())
        finish(commands);
    return done;
}

GpuSurface::Update GpuSurface::record_update(Commands& commands, const Volume& after,
                                             std::span<const ChangedBrick> changed) {
    PALPATE_ASSERT(after.size() == volume_.size() && after.type() == volume_.type());
    Update done;
    if (cpu_)
        done.blocks = cpu_->update(after, changed).blocks;
    else
        done.blocks = block::blocks_that_read(volume_, after, changed, options_, glm::ivec3(-lead_),
                                              count_ - lead_);
    volume_ = after;
    if (done.blocks.empty())
        return done;
    if (cpu_) {
        std::vector<uint32_t> numbers;
        for (const glm::ivec3& b : done.blocks)
            numbers.push_back(number_of(b));
        done.triangles = find_room(commands, numbers, made(numbers));
        upload_made(commands, /*all=*/false);
        return done;
    }
    // Blocks on one side of iso are not made; what they held goes.
    std::vector<uint32_t> numbers, emptied;
    for (const glm::ivec3& b : done.blocks) {
        const bool empty = lead_ == 0 && block::is_on_one_side(after, iso_, b);
        (empty ? emptied : numbers).push_back(number_of(b));
    }
    std::vector<gpu::ExtractCount> counts = counted(numbers);
    numbers.insert(numbers.end(), emptied.begin(), emptied.end());
    counts.resize(numbers.size());
    samples_->bring_changes(commands, after, changed);
    done.triangles = find_room(commands, numbers, counts);
    record_emit(commands);
    return done;
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

Mesh GpuSurface::mesh() {
    if (cpu_)
        return cpu_->mesh();
    const std::vector<glm::ivec3> order = blocks();
    const std::vector<BlockMesh> meshes = read_back();
    std::vector<block::PlacedBlock> placed;
    for (size_t i = 0; i < order.size(); ++i)
        placed.push_back({order[i], &meshes[i]});
    return block::join_blocks(volume_.grid(), options_, placed);
}

} // namespace palpate
