#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <new>

#include "engine/base/mapped_file.h"
#include "engine/io/brick_file.h"
#include "engine/io/brick_file_layout.h"
#include "engine/volume/builder.h"
#include "engine/volume/pyramid.h"

namespace palpate {

namespace {

using io::BrickFileEntry;
using io::BrickFileHeader;

constexpr uint32_t kMostSamples = 1 << 20; // on an axis

// The known contents of an open file: everything checked but the samples.
struct Contents {
    BrickFileHeader header{};
    std::vector<Grid> grids; // by level
    std::vector<BrickFileEntry> entries;
    std::vector<BlockRanges> ranges;

    ScalarType type() const { return static_cast<ScalarType>(header.type); }
};

// How many bricks a level of this size has; sizes are bounded, so that it passes no 64 bits.
uint64_t bricks_in(glm::uvec3 size) {
    const glm::uvec3 n = (size + (kBrickSide - 1)) / kBrickSide;
    return uint64_t{n.x} * n.y * n.z;
}

Result<BrickFileHeader> read_header(const std::string& name, std::span<const std::byte> bytes) {
    BrickFileHeader header;
    if (bytes.size() < sizeof header)
        return fail("{}: expected a brick file of at least {} bytes, found {}", name, sizeof header,
                    bytes.size());
    std::memcpy(&header, bytes.data(), sizeof header);
    if (std::memcmp(header.magic, io::kBrickFileMagic, sizeof header.magic) != 0)
        return fail("{}: expected a brick file, found other first bytes", name);
    if (header.version != io::kBrickFileVersion || header.header_bytes != sizeof header)
        return fail("{}: expected a brick file of version {}, found version {}", name,
                    io::kBrickFileVersion, header.version);
    const uint32_t crc = io::checksum(bytes.first(offsetof(BrickFileHeader, header_crc)));
    if (crc != header.header_crc)
        return fail("{}: the header is damaged: expected checksum {:08x}, found {:08x}", name,
                    header.header_crc, crc);
    if (header.file_bytes != bytes.size())
        return fail("{}: the file is cut or grown: expected {} bytes, found {}", name,
                    header.file_bytes, bytes.size());
    return header;
}

// Sizes against one another and against the file, before anything is allocated by them.
Result<std::vector<Grid>> check_sizes(const std::string& name, const BrickFileHeader& header) {
    if (header.type > static_cast<uint32_t>(ScalarType::f32))
        return fail("{}: expected a sample type 0 .. 4, found {}", name, header.type);
    Grid grid;
    for (int axis = 0; axis < 3; ++axis) {
        grid.size[axis] = header.size[axis];
        if (header.size[axis] < 1 || header.size[axis] > kMostSamples)
            return fail("{}: expected 1 .. {} samples on each axis, found {}", name, kMostSamples,
                        header.size[axis]);
    }
    std::memcpy(&grid.world_from_index[0][0], header.world_from_index,
                sizeof header.world_from_index);
    const double volume = glm::determinant(glm::dmat3(grid.world_from_index));
    for (const double value : header.world_from_index)
        if (!std::isfinite(value) || !std::isfinite(volume) || volume == 0.0)
            return fail("{}: expected a grid with three directions, found a matrix without", name);
    if (header.level_count != level_count(grid.size))
        return fail("{}: expected {} levels, found {}", name, level_count(grid.size),
                    header.level_count);
    std::vector<Grid> grids{grid};
    uint64_t bricks = bricks_in(grid.size);
    while (grids.size() < header.level_count) {
        grids.push_back(coarser_grid(grids.back()));
        bricks += bricks_in(grids.back().size);
    }
    const uint64_t table = io::range_table_bytes(static_cast<ScalarType>(header.type));
    if (bricks > header.index_bytes / sizeof(BrickFileEntry) ||
        header.range_count > header.index_bytes / table ||
        header.index_bytes != bricks * sizeof(BrickFileEntry) + header.range_count * table)
        return fail("{}: expected an index of {} bricks and {} range tables, found one of {} bytes",
                    name, bricks, header.range_count, header.index_bytes);
    if (header.index_offset < sizeof header || header.index_bytes > header.file_bytes ||
        header.index_offset != header.file_bytes - header.index_bytes)
        return fail("{}: expected the index at the end of the file, found {} bytes at {}", name,
                    header.index_bytes, header.index_offset);
    return grids;
}

Result<void> check_entry(const std::string& name, const Contents& contents, uint64_t number) {
    const BrickFileEntry& entry = contents.entries[number];
    const BrickFileHeader& header = contents.header;
    if (entry.no_data > kBrickSamples)
        return fail("{}: brick {}: expected at most {} samples without data, found {}", name,
                    number, kBrickSamples, entry.no_data);
    if (entry.bytes == 0)
        return {};
    if (entry.bytes > io::packed_bound(contents.type()) || entry.offset < sizeof header ||
        entry.offset > header.index_offset || entry.bytes > header.index_offset - entry.offset)
        return fail("{}: brick {}: expected its bytes in {} .. {}, found {} at {}", name, number,
                    sizeof header, header.index_offset, entry.bytes, entry.offset);
    if (entry.ranges >= header.range_count)
        return fail("{}: brick {}: expected a range table below {}, found {}", name, number,
                    header.range_count, entry.ranges);
    return {};
}

Result<Contents> read_contents(const std::string& name, const MappedFile& file) {
    Contents contents;
    PALPATE_TRY(const BrickFileHeader header, read_header(name, file.bytes()));
    contents.header = header;
    PALPATE_TRY(contents.grids, check_sizes(name, header));
    const auto index = file.bytes().subspan(header.index_offset);
    if (const uint32_t crc = io::checksum(index); crc != header.index_crc)
        return fail("{}: the index is damaged: expected checksum {:08x}, found {:08x}", name,
                    header.index_crc, crc);
    const size_t table = io::range_table_bytes(contents.type());
    contents.ranges.resize(header.range_count);
    contents.entries.resize((index.size() - table * header.range_count) / sizeof(BrickFileEntry));
    const size_t entry_bytes = contents.entries.size() * sizeof(BrickFileEntry);
    std::memcpy(contents.entries.data(), index.data(), entry_bytes);
    for (size_t i = 0; i < contents.ranges.size(); ++i)
        io::read_ranges(index.subspan(entry_bytes + i * table, table), contents.type(),
                        contents.ranges[i]);
    for (uint64_t i = 0; i < contents.entries.size(); ++i)
        PALPATE_TRY(check_entry(name, contents, i));
    file.count_read(uint64_t{1} << 62); // the index is copied: its pages may go
    return contents;
}

// The samples of all levels' bricks, numbered as in the index.
class FileSource : public BrickSource {
 public:
    FileSource(std::string name, MappedFile file, Contents contents, uint64_t cache_bytes)
        : name_(std::move(name)),
          file_(std::move(file)),
          contents_(std::move(contents)),
          brick_bytes_(kBrickSamples * bytes_per_sample(contents_.type())),
          cache_(contents_.entries.size(), brick_bytes_, cache_bytes) {}

    const Contents& contents() const { return contents_; }
    BrickCache::Stats stats() const { return cache_.stats(); }

    SamplesPtr fetch(uint64_t key) const override {
        return cache_.get(key, [&] { return load(key); });
    }

 private:
    SamplesPtr load(uint64_t key) const {
        const BrickFileEntry& entry = contents_.entries[key];
        if (uint64_t now = 0; !file_.is_whole(now))
            throw SourceError(
                fmt::format("{}: was cut while it was read: expected {} bytes, "
                            "found {}",
                            name_, file_.bytes().size(), now));
        const auto packed = file_.bytes().subspan(entry.offset, entry.bytes);
        if (const uint32_t crc = io::checksum(packed); crc != entry.crc)
            throw SourceError(
                fmt::format("{}: {} is damaged: expected checksum {:08x}, found "
                            "{:08x}",
                            name_, brick_name(key), entry.crc, crc));
        constexpr std::align_val_t alignment{64};
        const std::shared_ptr<std::byte[]> samples(
            static_cast<std::byte*>(::operator new(brick_bytes_, alignment)),
            [](std::byte* p) { ::operator delete (p, std::align_val_t{64}); });
        const Result<void> unpacked =
            io::unpack_brick(packed, contents_.type(), {samples.get(), brick_bytes_});
        if (!unpacked)
            throw SourceError(
                fmt::format("{}: {} {}", name_, brick_name(key), unpacked.error().message));
        file_.count_read(entry.bytes);
        return samples;
    }

    std::string brick_name(uint64_t key) const {
        uint32_t level = 0;
        for (; key >= bricks_in(contents_.grids[level].size); ++level)
            key -= bricks_in(contents_.grids[level].size);
        const glm::uvec3 n = (contents_.grids[level].size + (kBrickSide - 1)) / kBrickSide;
        return fmt::format("brick ({}, {}, {}) of level {}", key % n.x, key / n.x % n.y,
                           key / (uint64_t{n.x} * n.y), level);
    }

    std::string name_;
    MappedFile file_;
    Contents contents_;
    size_t brick_bytes_;
    mutable BrickCache cache_;
};

// The bricks of one value, one for each value.
class ConstantBricks {
 public:
    explicit ConstantBricks(ScalarType type) : type_(type) {}

    BrickPtr get(uint64_t value_bytes, glm::uvec3 valid, uint32_t no_data) {
        const glm::uvec3 key_size = no_data > 0 ? valid : glm::uvec3(0); // counts of no-data differ
        BrickPtr& brick = bricks_[{value_bytes, key_size.x, key_size.y, key_size.z}];
        if (!brick)
            brick = visit_scalar(type_, [&](auto t) {
                std::memcpy(&t, &value_bytes, sizeof t);
                return Brick::make(std::span<const decltype(t)>(&t, 1), valid);
            });
        return brick;
    }

 private:
    ScalarType type_;
    std::map<std::tuple<uint64_t, uint32_t, uint32_t, uint32_t>, BrickPtr> bricks_;
};

Volume make_level(const std::shared_ptr<const FileSource>& source, uint32_t level,
                  uint64_t first_key, ConstantBricks& constants) {
    const Contents& contents = source->contents();
    const Grid& grid = contents.grids[level];
    VolumeBuilder builder(grid, contents.type());
    const glm::uvec3 n = builder.brick_count();
    for (uint64_t i = 0; i < bricks_in(grid.size); ++i) {
        const glm::uvec3 position(i % n.x, i / n.x % n.y, i / (uint64_t{n.x} * n.y));
        const BrickFileEntry& entry = contents.entries[first_key + i];
        const glm::uvec3 valid =
            glm::min(glm::uvec3(kBrickSide), grid.size - position * kBrickSide);
        if (entry.bytes == 0) {
            builder.set_brick(position, constants.get(entry.offset, valid, entry.no_data));
            continue;
        }
        const std::shared_ptr<const BlockRanges> ranges(source, &contents.ranges[entry.ranges]);
        builder.set_brick(position, Brick::in_source(source, first_key + i,
                                                     {contents.type(), ranges, entry.no_data}));
    }
    return builder.finish();
}

} // namespace

bool is_brick_file(const std::filesystem::path& path) {
    char magic[sizeof io::kBrickFileMagic] = {};
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
        return false;
    std::ifstream in(path, std::ios::binary);
    return in.read(magic, sizeof magic) &&
           std::memcmp(magic, io::kBrickFileMagic, sizeof magic) == 0;
}

Result<BrickFile> open_brick_file(const std::filesystem::path& path, uint64_t cache_bytes) {
    const std::string name = path.string();
    PALPATE_TRY(MappedFile file, MappedFile::open(path));
    PALPATE_TRY(Contents contents, read_contents(name, file));
    const BrickFileHeader header = contents.header;
    const auto source =
        std::make_shared<const FileSource>(name, std::move(file), std::move(contents), cache_bytes);
    ConstantBricks constants(source->contents().type());
    std::vector<Volume> levels;
    uint64_t first_key = 0;
    for (uint32_t level = 0; level < header.level_count; ++level) {
        levels.push_back(make_level(source, level, first_key, constants));
        first_key += bricks_in(levels.back().size());
    }
    BrickFile opened{levels.front(), {levels.begin() + 1, levels.end()}, false, {}, {}};
    opened.labels = (header.flags & io::kBrickFileLabels) != 0;
    opened.modality.assign(header.modality, strnlen(header.modality, sizeof header.modality));
    opened.cache = [source] { return source->stats(); };
    return opened;
}

} // namespace palpate
