#include "engine/surface_gpu/gpu_nets.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <tuple>

#include "engine/base/assert.h"
#include "spirv/net_cells.h"
#include "spirv/net_emit.h"
#include "spirv/net_links.h"
#include "spirv/net_smooth.h"

namespace palpate {

namespace {

constexpr float kLambda = 0.5f, kMu = -0.53f; // as surface_nets()
constexpr uint32_t kNetVertexQuantum = 16, kNetTriangleQuantum = 8;

glm::uvec3 net_groups_for(size_t items) {
    const size_t most = gpu::kNetMostGroups;
    return {std::min(items, most), (items + most - 1) / most, 1};
}

uint32_t rounded(uint32_t count, uint32_t quantum) {
    return (count + quantum - 1) / quantum * quantum;
}

} // namespace

GpuNets::GpuNets(NetPipelines& pipelines, const Volume& labels, const SurfaceNetsOptions& options)
    : pipelines_(&pipelines),
      device_(&pipelines.device()),
      labels_(labels),
      options_(options),
      count_(glm::ivec3(labels.size()) / 8 + 1),
      samples_(*device_, labels) {}

Result<GpuNets> GpuNets::make(NetPipelines& pipelines, const Volume& labels,
                              const SurfaceNetsOptions& options) {
    PALPATE_ASSERT(labels.type() == ScalarType::u8 || labels.type() == ScalarType::u16);
    PALPATE_ASSERT(options.bound >= 0.0 && options.bound < 0.5 && options.rounds == 0);
    PALPATE_TRY(SampleImage::fits(pipelines.device(), labels));
    GpuNets nets(pipelines, labels, options);
    PALPATE_TRY(nets.make_all());
    return nets;
}

glm::ivec3 GpuNets::block_at(uint32_t number) const {
    const auto n = static_cast<int>(number);
    return {n % count_.x, n / count_.x % count_.y, n / (count_.x * count_.y)};
}

int GpuNets::reach_of_smoothing() const {
    return static_cast<int>((2 * options_.passes + 7) / 8); // a step looks one cell further
}

std::vector<NetCounter::Count> GpuNets::counted(const std::vector<uint32_t>& numbers) const {
    std::vector<NetCounter::Count> counts(numbers.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, numbers.size(), 16),
                      [&](const tbb::blocked_range<size_t>& range) {
                          NetCounter counter;
                          for (size_t i = range.begin(); i < range.end(); ++i)
                              counts[i] = counter.count(labels_, block_at(numbers[i]));
                      });
    return counts;
}

Result<void> GpuNets::make_arrays(const std::vector<NetCounter::Count>& counts) {
    uint64_t slots = 0, vertices = 0, triangles = 0;
    for (const NetCounter::Count& count : counts) {
        slots += count.vertices > 0;
        vertices += rounded(count.vertices + count.more_vertices, kNetVertexQuantum);
        triangles += rounded(count.triangles, kNetTriangleQuantum);
    }
    const auto roomy = [](uint64_t count, uint64_t quantum) {
        return (count + count / 5 + 1024) / quantum * quantum;
    };
    slots = roomy(slots, 1);
    vertices = roomy(vertices, kNetVertexQuantum);
    triangles = roomy(triangles, kNetTriangleQuantum);
    const uint64_t most = device_->limits().maxStorageBufferRange;
    const uint64_t largest =
        std::max({slots * 512 * sizeof(glm::uvec2), triangles * sizeof(glm::uvec3),
                  vertices * (options_.passes > 0 ? gpu::kNetMostLinks * sizeof(uint32_t)
                                                  : 2 * sizeof(glm::vec3))});
    if (largest > most)
        return fail("{}: walls of labels: expected buffers of at most {} bytes, found {}",
                    device_->info().name, most, largest);
    const auto buffer = [&](const char* name, uint64_t count, uint64_t bytes) {
        return Buffer(*device_, name, count * bytes, Memory::device);
    };
    arrays_.reset();
    arrays_.emplace(Arrays{
        buffer("places of net blocks", records_.size(), sizeof(gpu::NetPlace)),
        buffer("net cells", slots * 512, sizeof(glm::uvec2)),
        buffer("net vertices", vertices, sizeof(uint32_t)),
        buffer("net offsets", 2 * vertices, sizeof(glm::vec3)),
        buffer("net positions", vertices, sizeof(glm::vec3)),
        buffer("net triangles", triangles, sizeof(glm::uvec3)),
        buffer("net labels", triangles, sizeof(uint32_t)),
        options_.passes > 0
            ? std::optional(buffer("net links", vertices * gpu::kNetMostLinks, sizeof(uint32_t)))
            : std::nullopt,
        RangeAllocator(static_cast<uint32_t>(slots), 1),
        RangeAllocator(static_cast<uint32_t>(vertices), kNetVertexQuantum),
        RangeAllocator(static_cast<uint32_t>(triangles), kNetTriangleQuantum)});
    return {};
}

Result<void> GpuNets::make_all() {
    const size_t blocks = size_t(count_.x) * size_t(count_.y) * size_t(count_.z);
    records_.assign(blocks, std::nullopt);
    triangles_ = 0;
    std::vector<uint32_t> numbers(blocks);
    for (uint32_t n = 0; n < blocks; ++n)
        numbers[n] = n;
    const std::vector<NetCounter::Count> counts = counted(numbers);
    PALPATE_TRY(make_arrays(counts));
    Commands commands(*device_);
    commands.zero(arrays_->places);
    commands.zero(arrays_->triangles);
    const bool found = find_room(commands, numbers, counts);
    PALPATE_ASSERT(found);
    Blocks all;
    for (uint32_t n = 0; n < blocks; ++n)
        if (records_[n])
            all.insert(n);
    record_blocks(commands, all, all);
    commands.submit();
    commands.finish();
    return {};
}

// New places for blocks, and what the device is to know of them; false where one has none.
bool GpuNets::find_room(Commands& commands, const std::vector<uint32_t>& numbers,
                        const std::vector<NetCounter::Count>& counts) {
    Arrays& to = *arrays_;
    std::vector<Commands::Bytes> erased;
    uint32_t most = 0;
    for (const uint32_t number : numbers)
        if (std::optional<Record>& record = records_[number]) {
            to.free_slots.give(record->slot, 1);
            to.free_vertices.give(record->first_vertex,
                                  record->count.vertices + record->count.more_vertices);
            triangles_ -= record->count.triangles;
            if (record->count.triangles > 0) {
                to.free_triangles.give(record->first_triangle, record->count.triangles);
                most = std::max(most, record->count.triangles);
                erased.push_back({0, record->first_triangle * sizeof(glm::uvec3),
                                  record->count.triangles * sizeof(glm::uvec3)});
            }
            record.reset();
        }
    if (!erased.empty()) {
        const BufferSlice zeros = commands.staging(most * sizeof(glm::uvec3));
        std::ranges::fill(zeros.mapped(), std::byte{0});
        for (Commands::Bytes& piece : erased)
            piece.from = zeros.offset;
        commands.copy(*zeros.buffer, to.triangles, erased);
    }
    const BufferSlice places = commands.staging(numbers.size() * sizeof(gpu::NetPlace));
    std::vector<Commands::Bytes> pieces; // of blocks side by side
    for (size_t i = 0; i < numbers.size(); ++i) {
        const NetCounter::Count& count = counts[i];
        gpu::NetPlace place{0, 0};
        if (count.vertices > 0) {
            const auto slot = to.free_slots.take(1);
            const auto vertex = to.free_vertices.take(count.vertices + count.more_vertices);
            const auto triangle =
                count.triangles > 0 ? to.free_triangles.take(count.triangles) : 0u;
            if (!slot || !vertex || !triangle)
                return false;
            records_[numbers[i]] = {count, *slot, *vertex, *triangle};
            triangles_ += count.triangles;
            place = {*slot + 1, *vertex};
        }
        const uint64_t at = i * sizeof place, there = numbers[i] * sizeof place;
        std::memcpy(places.mapped().data() + at, &place, sizeof place);
        if (!pieces.empty() && pieces.back().to + pieces.back().count == there)
            pieces.back().count += sizeof place;
        else
            pieces.push_back({places.offset + at, there, sizeof place});
    }
    commands.copy(*places.buffer, to.places, pieces);
    return true;
}

BufferSlice GpuNets::jobs_of(Commands& commands, const Blocks& blocks) const {
    const auto count = static_cast<uint32_t>(blocks.size());
    const BufferSlice jobs = commands.staging(sizeof count + count * sizeof(gpu::NetJob));
    std::byte* to = jobs.mapped().data();
    std::memcpy(to, &count, sizeof count);
    to += sizeof count;
    for (const uint32_t number : blocks) {
        const Record& record = *records_[number];
        const gpu::NetJob job{number, record.slot, record.first_vertex, record.count.vertices,
                              record.first_triangle};
        std::memcpy(to, &job, sizeof job);
        to += sizeof job;
    }
    return jobs;
}

// The cells of some blocks are found anew, and with smoothing their offsets go through all its
// steps; then blocks are emitted.
void GpuNets::record_blocks(Commands& commands, const Blocks& cells, const Blocks& emitted) {
    if (cells.empty() && emitted.empty())
        return;
    Arrays& arrays = *arrays_;
    gpu::NetFrame frame{.size = glm::ivec3(labels_.size()),
                        .blocks = glm::uvec3(count_),
                        .spacing_mm = glm::vec3(spacing_mm(labels_.grid())),
                        .bound = static_cast<float>(options_.bound),
                        .share = 0.0f,
                        .from = 0,
                        .to = 0};
    const auto uniform = [&] {
        return bind_uniform(gpu::kNetFrame, commands.upload(bytes_of(frame)));
    };
    const Bound samples = bind_sampled(gpu::kNetSamples, samples_.image(), pipelines_->nearest());
    const auto writes = Use::storage_write;
    commands.begin_pass("nets");
    if (!cells.empty()) {
        const Bound jobs = bind_storage(gpu::kNetJobs, jobs_of(commands, cells));
        const glm::uvec3 groups = net_groups_for(cells.size());
        const Bound find[] = {uniform(),
                              samples,
                              jobs,
                              bind_storage(gpu::kNetCells, arrays.cells, writes),
                              bind_storage(gpu::kNetVertices, arrays.vertices, writes),
                              bind_storage(gpu::kNetOffsets, arrays.offsets, writes)};
        commands.dispatch(pipelines_->get(spirv::NetCells{}), find, groups);
        if (options_.passes > 0) {
            const Bound link[] = {uniform(),
                                  jobs,
                                  bind_storage(gpu::kNetPlaces, arrays.places),
                                  bind_storage(gpu::kNetCells, arrays.cells),
                                  bind_storage(gpu::kNetVertices, arrays.vertices),
                                  bind_storage(gpu::kNetLinks, *arrays.links, writes)};
            commands.dispatch(pipelines_->get(spirv::NetLinks{}), link, groups);
        }
        for (uint32_t step = 0; step < 2 * options_.passes; ++step) {
            const uint32_t half = arrays.free_vertices.capacity();
            frame.share = step % 2 == 0 ? kLambda : kMu;
            frame.from = step % 2 == 0 ? 0 : half;
            frame.to = half - frame.from;
            const Bound smooth[] = {uniform(), jobs,
                                    bind_storage(gpu::kNetVertices, arrays.vertices),
                                    bind_storage(gpu::kNetOffsets, arrays.offsets, writes),
                                    bind_storage(gpu::kNetLinks, *arrays.links)};
            commands.dispatch(pipelines_->get(spirv::NetSmooth{}), smooth, groups);
        }
    }
    if (!emitted.empty()) {
        frame.from = 0;
        const Bound emit[] = {uniform(),
                              samples,
                              bind_storage(gpu::kNetJobs, jobs_of(commands, emitted)),
                              bind_storage(gpu::kNetPlaces, arrays.places),
                              bind_storage(gpu::kNetCells, arrays.cells),
                              bind_storage(gpu::kNetVertices, arrays.vertices),
                              bind_storage(gpu::kNetOffsets, arrays.offsets),
                              bind_storage(gpu::kNetPositions, arrays.positions, writes),
                              bind_storage(gpu::kNetTriangles, arrays.triangles, writes),
                              bind_storage(gpu::kNetLabels, arrays.labels, writes)};
        commands.dispatch(pipelines_->get(spirv::NetEmit{}), emit, net_groups_for(emitted.size()));
    }
    commands.end_pass();
}

// Those with walls among some blocks and all within `reach` of them.
GpuNets::Blocks GpuNets::around(const Blocks& blocks, int reach) const {
    Blocks found;
    for (const uint32_t number : blocks) {
        const glm::ivec3 low = glm::max(block_at(number) - reach, glm::ivec3(0));
        const glm::ivec3 high = glm::min(block_at(number) + reach, count_ - 1);
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) {
                    const auto one = static_cast<uint32_t>(x + count_.x * (y + count_.y * z));
                    if (records_[one])
                        found.insert(one);
                }
    }
    return found;
}

Result<size_t> GpuNets::update(const Volume& after) {
    PALPATE_ASSERT(after.grid() == labels_.grid() && after.type() == labels_.type());
    const std::vector<ChangedBrick> changed = changed_bricks(labels_, after);
    labels_ = after;
    // A block of cells reads the samples from two before its own on.
    Blocks read;
    for (const ChangedBrick& brick : changed)
        for (uint64_t left = brick.blocks; left != 0; left &= left - 1) {
            const int n = std::countr_zero(left), side = int{kBlocksPerSide};
            const glm::ivec3 at = glm::ivec3(brick.position) * side +
                                  glm::ivec3(n % side, n / side % side, n / (side * side));
            for (int i = 0; i < 8; ++i) {
                const glm::ivec3 one = at + glm::ivec3(i & 1, i >> 1 & 1, i >> 2);
                if (glm::all(glm::lessThan(one, count_)))
                    read.insert(
                        static_cast<uint32_t>(one.x + count_.x * (one.y + count_.y * one.z)));
            }
        }
    if (read.empty())
        return size_t{0};
    const std::vector<uint32_t> numbers(read.begin(), read.end());
    Commands commands(*device_);
    samples_.bring_changes(commands, after, changed);
    if (!find_room(commands, numbers, counted(numbers))) {
        commands.submit();
        commands.finish();
        PALPATE_TRY(make_all());
        return around(read, std::max({count_.x, count_.y, count_.z})).size();
    }
    // The changes move vertices within the reach of smoothing, and blocks refer to the vertices of
    // those before them. Offsets there depend on twice that reach.
    const int reach = reach_of_smoothing();
    const Blocks emitted = around(read, reach + 1);
    const Blocks cells = around(read, reach == 0 ? 0 : 2 * reach + 2);
    record_blocks(commands, cells, emitted);
    commands.submit();
    commands.finish();
    return emitted.size();
}

Mesh GpuNets::mesh() {
    Mesh mesh;
    mesh.world_from_mesh = world_from_mesh(labels_.grid());
    Commands commands(*device_);
    const BufferSlice positions = commands.read_back(arrays_->positions);
    const BufferSlice triangles = commands.read_back(arrays_->triangles);
    const BufferSlice labels = commands.read_back(arrays_->labels);
    commands.submit();
    commands.finish();
    const auto* position = reinterpret_cast<const glm::vec3*>(positions.mapped().data());
    const auto* triangle = reinterpret_cast<const glm::uvec3*>(triangles.mapped().data());
    const auto* pair = reinterpret_cast<const uint32_t*>(labels.mapped().data());
    std::vector<uint32_t> renamed(arrays_->free_vertices.capacity());
    const auto add = [&](uint32_t vertex) {
        renamed[vertex] = static_cast<uint32_t>(mesh.positions.size());
        mesh.positions.push_back(position[vertex]);
    };
    for (const auto& record : records_)
        for (uint32_t v = 0; record && v < record->count.vertices; ++v)
            add(record->first_vertex + v);
    // A vertex on a split side is known by the ends of the side and its place: a side may have two
    // such, a quarter of a sample apart.
    std::map<std::tuple<uint32_t, uint32_t, float, float, float>, uint32_t> on_sides;
    for (const auto& record : records_)
        for (uint32_t t = 0; record && t < record->count.triangles; ++t) {
            const glm::uvec3* one = triangle + record->first_triangle + t;
            const auto is_more = [&](uint32_t v) {
                return v - record->first_vertex - record->count.vertices <
                       record->count.more_vertices;
            };
            // A fan has its middle, and two vertices that follow each other on the rim.
            if (!is_more(one->x))
                continue;
            if (t == 0 || one[-1].x != one->x)
                add(one->x);
            if (!is_more(one->z))
                continue;
            const uint32_t from = one[0].y, to = one[1].z;
            const glm::vec3 at = position[one->z];
            const auto [found, is_new] = on_sides.try_emplace(
                {std::min(from, to), std::max(from, to), at.x, at.y, at.z}, one->z);
            if (is_new)
                add(one->z);
            else
                renamed[one->z] = renamed[found->second];
        }
    for (const auto& record : records_)
        for (uint32_t t = 0; record && t < record->count.triangles; ++t) {
            const uint32_t at = record->first_triangle + t;
            mesh.triangles.emplace_back(renamed[triangle[at].x], renamed[triangle[at].y],
                                        renamed[triangle[at].z]);
            mesh.labels.push_back(static_cast<uint16_t>(pair[at] & 0xffff));
            mesh.outer_labels.push_back(static_cast<uint16_t>(pair[at] >> 16));
        }
    return mesh;
}

} // namespace palpate
