#include <fcntl.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <map>
#include <tuple>

#include "engine/base/assert.h"
#include "engine/base/fd.h"
#include "engine/base/file.h"
#include "engine/io/brick_file.h"
#include "engine/io/brick_file_layout.h"
#include "engine/volume/pyramid.h"

namespace palpate {

namespace {

using io::BrickFileEntry;
using io::BrickFileHeader;

glm::uvec3 bricks_of(glm::uvec3 size) {
    return (size + (kBrickSide - 1)) / kBrickSide;
}

size_t count_of(glm::uvec3 n) {
    return size_t{n.x} * n.y * n.z;
}

glm::uvec3 position_of(size_t i, glm::uvec3 count) {
    return {i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y)};
}

// A brick ready for the file.
struct Packed {
    uint32_t level;
    glm::uvec3 position;
    BrickFileEntry entry{}; // offset and ranges are set when it is written
    std::vector<std::byte> bytes, ranges;
};

Packed pack(const Brick& brick, uint32_t level, glm::uvec3 position) {
    Packed packed{level, position, {}, {}, {}};
    packed.entry.no_data = brick.no_data_count();
    if (brick.is_constant()) {
        const Brick::Pinned pinned = brick.pin();
        std::memcpy(&packed.entry.offset, pinned.bytes, bytes_per_sample(brick.type()));
        return packed;
    }
    thread_local std::vector<std::byte> planes;
    io::pack_brick(brick, planes, packed.bytes);
    packed.entry.bytes = static_cast<uint32_t>(packed.bytes.size());
    packed.entry.crc = io::checksum(packed.bytes);
    io::append_ranges(brick, packed.ranges);
    return packed;
}

// The levels being made: sizes, and the coarse bricks whose finer ones are still arriving.
class Levels {
 public:
    explicit Levels(const BrickStream& stream)
        : type_(stream.type),
          reduction_(stream.labels ? Reduction::first : Reduction::mean),
          sizes_{stream.grid.size} {
        while (sizes_.size() < level_count(stream.grid.size))
            sizes_.push_back((sizes_.back() + 1u) / 2u);
    }

    uint32_t count() const { return static_cast<uint32_t>(sizes_.size()); }
    glm::uvec3 bricks(uint32_t level) const { return bricks_of(sizes_[level]); }
    glm::uvec3 valid(uint32_t level, glm::uvec3 position) const {
        return glm::min(glm::uvec3(kBrickSide), sizes_[level] - position * kBrickSide);
    }

    // Passes a finished brick on to the levels above it, up to `until`: each brick that becomes
    // whole by it is handed to emit(brick, level, position).
    template <class Emit>
    void add(const BrickPtr& brick, uint32_t level, glm::uvec3 position, uint32_t until,
             const Emit& emit) {
        if (level >= until)
            return;
        const glm::uvec3 above = position / 2u;
        Growing& growing = growing_[{level + 1, above.z, above.y, above.x}];
        if (growing.samples.empty()) {
            growing.samples.resize(kBrickSamples * bytes_per_sample(type_));
            growing.missing = count_of(glm::min(glm::uvec3(2), bricks(level) - 2u * above));
        }
        const BrickPtr made = visit_scalar(type_, [&](auto t) -> BrickPtr {
            using T = decltype(t);
            const std::span<T> samples(reinterpret_cast<T*>(growing.samples.data()), kBrickSamples);
            reduce_brick<T>(*brick, position, valid(level, position), reduction_, samples);
            if (--growing.missing > 0)
                return nullptr;
            return Brick::make(std::span<const T>(samples), valid(level + 1, above));
        });
        if (!made)
            return;
        growing_.erase({level + 1, above.z, above.y, above.x});
        emit(made, level + 1, above);
        add(made, level + 1, above, until, emit);
    }

 private:
    struct Growing {
        std::vector<std::byte> samples;
        size_t missing = 0;
    };
    ScalarType type_;
    Reduction reduction_;
    std::vector<glm::uvec3> sizes_;
    std::map<std::tuple<uint32_t, uint32_t, uint32_t, uint32_t>, Growing> growing_;
};

// The file being written: bricks in the order they come, then the index, then the header.
class Output {
 public:
    Output(std::string name, Fd fd, const Levels& levels)
        : name_(std::move(name)), fd_(std::move(fd)), at_(sizeof(BrickFileHeader)) {
        for (uint32_t level = 0; level < levels.count(); ++level)
            entries_.emplace_back(count_of(levels.bricks(level)));
    }

    Result<void> write(Packed& packed, glm::uvec3 bricks) {
        BrickFileEntry& entry = packed.entry;
        if (entry.bytes > 0) {
            entry.offset = at_;
            entry.ranges = range_count_++;
            PALPATE_TRY(put(packed.bytes));
            ranges_.insert(ranges_.end(), packed.ranges.begin(), packed.ranges.end());
        }
        const glm::uvec3 p = packed.position;
        entries_[packed.level][p.x + bricks.x * (p.y + size_t{bricks.y} * p.z)] = entry;
        return {};
    }

    Result<void> finish(const BrickStream& stream) {
        BrickFileHeader header{};
        std::memcpy(header.magic, io::kBrickFileMagic, sizeof header.magic);
        header.version = io::kBrickFileVersion;
        header.header_bytes = sizeof header;
        header.index_offset = at_;
        header.range_count = range_count_;
        for (int axis = 0; axis < 3; ++axis)
            header.size[axis] = stream.grid.size[axis];
        header.type = static_cast<uint32_t>(stream.type);
        header.flags = stream.labels ? io::kBrickFileLabels : 0;
        header.level_count = static_cast<uint32_t>(entries_.size());
        std::memcpy(header.world_from_index, &stream.grid.world_from_index[0][0],
                    sizeof header.world_from_index);
        std::memcpy(header.modality, stream.modality.data(),
                    std::min(stream.modality.size(), sizeof header.modality - 1));
        std::vector<std::byte> index;
        for (const auto& level : entries_) {
            const auto bytes = std::as_bytes(std::span(level));
            index.insert(index.end(), bytes.begin(), bytes.end());
        }
        index.insert(index.end(), ranges_.begin(), ranges_.end());
        header.index_bytes = index.size();
        header.index_crc = io::checksum(index);
        PALPATE_TRY(put(index));
        header.file_bytes = at_;
        const auto head = std::as_bytes(std::span(&header, 1));
        header.header_crc = io::checksum(head.first(offsetof(BrickFileHeader, header_crc)));
        at_ = 0;
        PALPATE_TRY(put(head));
        if (::close(fd_.release()) != 0)
            return failed();
        return {};
    }

 private:
    tl::unexpected<Error> failed() const {
        return fail("{}: cannot be written: {}", name_, std::strerror(errno));
    }
    Result<void> put(std::span<const std::byte> bytes) {
        if (!write_all_at(fd_, bytes, static_cast<off_t>(at_)))
            return failed();
        at_ += bytes.size();
        return {};
    }

    std::string name_;
    Fd fd_;
    uint64_t at_;
    uint32_t range_count_ = 0;
    std::vector<std::vector<BrickFileEntry>> entries_;
    std::vector<std::byte> ranges_;
};

// A page of bricks and what lies above it in the next two levels, ready for the file.
struct PackedPage {
    std::vector<Packed> bricks;
    BrickPtr top; // of level kPageLevel; null where there is no such level
};
constexpr uint32_t kPageLevel = 2; // at which a page of 4x4x4 bricks is one brick

PackedPage pack_page(const BrickStream& stream, const Levels& all, glm::uvec3 page) {
    PackedPage packed;
    Levels levels = all; // sizes; nothing grows in it yet
    const uint32_t until = std::min(kPageLevel, levels.count() - 1);
    const glm::uvec3 first = page * kPageSide;
    const glm::uvec3 count = glm::min(glm::uvec3(kPageSide), levels.bricks(0) - first);
    const auto keep = [&](const BrickPtr& brick, uint32_t level, glm::uvec3 position) {
        packed.bricks.push_back(pack(*brick, level, position));
        if (level == kPageLevel)
            packed.top = brick;
    };
    for (size_t i = 0; i < count_of(count); ++i) {
        const glm::uvec3 position = first + position_of(i, count);
        const BrickPtr brick = stream.brick(position);
        PALPATE_ASSERT(brick && brick->type() == stream.type);
        keep(brick, 0, position);
        levels.add(brick, 0, position, until, keep);
    }
    return packed;
}

// Pages are packed on all threads and written in their order.
Result<void> write_pages(Output& output, const BrickStream& stream, const std::string& name,
                         const BrickFileWriting& writing) {
    Levels levels(stream);
    const Levels empty = levels; // shared by the packing threads
    const glm::uvec3 pages = (levels.bricks(0) + (kPageSide - 1)) / kPageSide;
    const size_t total = count_of(pages);
    size_t next = 0, done = 0;
    Result<void> result;
    std::atomic<bool> failed{false}; // `result`, for the thread that begins pages
    const auto write = [&](Packed& packed) {
        if (result)
            result = output.write(packed, levels.bricks(packed.level));
        failed = !result;
    };
    using PagePtr = std::shared_ptr<PackedPage>;
    const auto begin = [&](tbb::flow_control& flow) -> size_t {
        if (next == total || failed || writing.stop.stop_requested()) {
            flow.stop();
            return 0;
        }
        return next++;
    };
    const auto make = [&](size_t page) {
        return std::make_shared<PackedPage>(pack_page(stream, empty, position_of(page, pages)));
    };
    const auto end = [&](const PagePtr& page) {
        for (Packed& packed : page->bricks)
            write(packed);
        if (page->top)
            levels.add(page->top, kPageLevel, position_of(done, pages), levels.count() - 1,
                       [&](const BrickPtr& brick, uint32_t level, glm::uvec3 position) {
                           Packed packed = pack(*brick, level, position);
                           write(packed);
                       });
        ++done;
        if (writing.progress)
            writing.progress(static_cast<double>(done) / static_cast<double>(total));
    };
    using tbb::filter_mode;
    tbb::parallel_pipeline(2 * static_cast<size_t>(tbb::this_task_arena::max_concurrency()),
                           tbb::make_filter<void, size_t>(filter_mode::serial_in_order, begin) &
                               tbb::make_filter<size_t, PagePtr>(filter_mode::parallel, make) &
                               tbb::make_filter<PagePtr, void>(filter_mode::serial_in_order, end));
    if (result && done < total)
        return fail("{}: writing was stopped", name);
    return result;
}

} // namespace

BrickStream stream_of(const Volume& volume) {
    return {volume.grid(), volume.type(), false, {}, [volume](glm::uvec3 position) {
                return volume.brick_ptr(position);
            }};
}

Result<void> save_brick_file(const std::filesystem::path& path, const BrickStream& stream,
                             const BrickFileWriting& writing) {
    const std::string name = path.string();
    return write_atomically(path, [&](const std::filesystem::path& temporary) -> Result<void> {
        Fd fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
        if (!fd)
            return fail("{}: cannot be written: {}", name, std::strerror(errno));
        Output output(name, std::move(fd), Levels(stream));
        try {
            PALPATE_TRY(write_pages(output, stream, name, writing));
        } catch (const SourceError& error) { // what is read proves to be damaged
            return fail("{}", error.what());
        }
        return output.finish(stream);
    });
}

} // namespace palpate
