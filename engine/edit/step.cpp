#include "engine/edit/step.h"

#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "engine/base/json_value.h"
#include "engine/volume/brick_source.h"
#include "engine/volume/builder.h"

namespace palpate {

namespace {

constexpr int kLevel = 3; // of zstd: 1 packs labels 1.5 times worse, 9 is 5 times slower
constexpr size_t kBlockRows = kBlockSide * kBlockSide;

struct BrickHeader {
    uint32_t x, y, z, pad;
    uint64_t blocks;
};

// Calls visit(offset of its first sample) for the 64 rows of a block.
template <class Visit>
void for_each_block_row(uint32_t block, Visit&& visit) {
    const glm::uvec3 first =
        kBlockSide * glm::uvec3(block % kBlocksPerSide, block / kBlocksPerSide % kBlocksPerSide,
                                block / (kBlocksPerSide * kBlocksPerSide));
    for (uint32_t row = 0; row < kBlockRows; ++row)
        visit(offset_in_brick(first + glm::uvec3(0, row % kBlockSide, row / kBlockSide)));
}

std::vector<std::byte> expanded(const Brick& brick) {
    std::vector<std::byte> bytes(kBrickSamples * bytes_per_sample(brick.type()));
    visit_scalar(brick.type(), [&](auto t) {
        using T = decltype(t);
        brick.read(std::span<T>(reinterpret_cast<T*>(bytes.data()), kBrickSamples));
    });
    return bytes;
}

// All that may have changed, told without reading a sample.
std::vector<ChangedBrick> unshared_bricks(const Volume& before, const Volume& after) {
    std::vector<ChangedBrick> bricks;
    for_each_brick(before, [&](glm::uvec3 at) {
        if (before.brick_ptr(at) != after.brick_ptr(at))
            bricks.push_back({at, ~uint64_t{0}});
    });
    return bricks;
}

constexpr uint32_t kMostSide = 1u << 17;            // samples of a volume that comes, on an axis
constexpr uint64_t kMostBricks = uint64_t{1} << 26; // and its bricks

std::string packed_bricks(ScalarType type, std::span<const ReplacedBrick> bricks) {
    const size_t sample = bytes_per_sample(type), row_bytes = kBlockSide * sample;
    std::string plain;
    const auto append = [&](const void* from, size_t bytes) {
        plain.append(static_cast<const char*>(from), bytes);
    };
    for (const ReplacedBrick& brick : bricks) {
        const glm::uvec3 at = brick.where.position;
        const BrickHeader header{at.x, at.y, at.z, 0, brick.where.blocks};
        append(&header, sizeof header);
        const std::vector<std::byte> a = expanded(*brick.before), b = expanded(*brick.after);
        for (uint64_t left = header.blocks; left != 0; left &= left - 1)
            for_each_block_row(static_cast<uint32_t>(std::countr_zero(left)), [&](uint32_t row) {
                for (size_t i = row * sample; i < row * sample + row_bytes; ++i)
                    plain.push_back(static_cast<char>(a[i] ^ b[i]));
            });
    }
    std::string packed(ZSTD_compressBound(plain.size()), '\0');
    const size_t bytes =
        ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), kLevel);
    packed.resize(ZSTD_isError(bytes) ? 0 : bytes);
    packed.shrink_to_fit();
    return packed;
}

tl::unexpected<Error> damaged() {
    return fail("history: a step is damaged and cannot be taken");
}

Result<Volume> with_packed_bricks(const Volume& now, std::string_view packed) {
    const size_t sample = bytes_per_sample(now.type()), row_bytes = kBlockSide * sample;
    const glm::uvec3 count = now.brick_count();
    const uint64_t most =
        (sizeof(BrickHeader) + kBrickSamples * sample) * uint64_t{count.x} * count.y * count.z;
    const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
    if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN || size > most)
        return damaged();
    std::string plain(size, '\0');
    if (ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size()) != size)
        return damaged();
    std::vector<PlacedBrick> made;
    for (size_t at = 0; at < plain.size();) {
        BrickHeader header;
        if (plain.size() - at < sizeof header)
            return damaged();
        std::memcpy(&header, plain.data() + at, sizeof header);
        at += sizeof header;
        const glm::uvec3 position(header.x, header.y, header.z);
        const size_t bytes = size_t(std::popcount(header.blocks)) * kBlockRows * row_bytes;
        if (!glm::all(glm::lessThan(position, count)) || plain.size() - at < bytes)
            return damaged();
        std::vector<std::byte> samples = expanded(now.brick(position));
        for (uint64_t left = header.blocks; left != 0; left &= left - 1)
            for_each_block_row(static_cast<uint32_t>(std::countr_zero(left)), [&](uint32_t row) {
                for (size_t i = row * sample; i < row * sample + row_bytes; ++i)
                    samples[i] ^= static_cast<std::byte>(plain[at++]);
            });
        made.push_back(
            {position, visit_scalar(now.type(), [&](auto t) {
                 using T = decltype(t);
                 return Brick::make(
                     std::span<const T>(reinterpret_cast<const T*>(samples.data()), kBrickSamples),
                     now.valid_in_brick(position));
             })});
    }
    return with_bricks(now, made);
}

// Does one part of a step; `change` leads a volume from one side to the other.
template <class Change>
Result<void> apply_part(Document& now, const VolumeStep& part, bool back, const Change& change) {
    using Kind = VolumeStep::Kind;
    std::vector<NamedVolume>& volumes = now.volumes;
    const auto there = std::find_if(volumes.begin(), volumes.end(),
                                    [&](const NamedVolume& v) { return v.name == part.name; });
    if (part.kind != Kind::changed && (part.kind == Kind::came) != back) {
        if (there != volumes.end())
            return damaged();
        PALPATE_TRY(Volume made, change(VolumeBuilder(part.frame.grid, part.type).finish()));
        volumes.insert(
            volumes.begin() + static_cast<ptrdiff_t>(std::min(part.frame.place, volumes.size())),
            {part.name, part.frame.kind, std::move(made)});
        return {};
    }
    if (there == volumes.end() || there->volume.type() != part.type)
        return damaged();
    if (part.kind != Kind::changed) {
        volumes.erase(there);
        return {};
    }
    PALPATE_TRY(there->volume, change(there->volume));
    return {};
}

// Calls do_part(i) for each part in the order for this direction, and returns what comes out.
template <class DoPart>
Result<Document> apply_parts(const Document& now, size_t count, const NotePages::Texts& notes,
                             bool back, const DoPart& do_part) {
    Document next = now;
    next.notes = now.notes.with(notes);
    for (size_t k = 0; k < count; ++k)
        PALPATE_TRY(do_part(next, back ? count - 1 - k : k));
    if (next.volumes.empty())
        return damaged();
    return next;
}

constexpr const char* kKindNames[] = {"changed", "came", "went"};

Json part_json(const VolumeStep& part, size_t bytes) {
    Json json{{"name", part.name},
              {"what", kKindNames[static_cast<size_t>(part.kind)]},
              {"type", name_of(part.type)},
              {"bytes", bytes}};
    if (part.kind == VolumeStep::Kind::changed)
        return json;
    const Grid& grid = part.frame.grid;
    Json matrix = Json::array();
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            matrix.push_back(grid.world_from_index[column][row]);
    json.update({{"kind", name_of(part.frame.kind)},
                 {"place", part.frame.place},
                 {"size", {grid.size.x, grid.size.y, grid.size.z}},
                 {"world_from_index", std::move(matrix)}});
    return json;
}

Json texts_json(const NotePages::Texts& texts) {
    Json json = Json::object();
    for (const auto& [page, text] : texts)
        json[page] = text;
    return json;
}

struct PackedPart {
    VolumeStep step; // without bricks
    std::string_view bytes;
};
struct PackedStep {
    std::vector<PackedPart> parts;
    NotePages::Texts notes_before, notes_after;
};

Grid read_grid(const JsonValue& in) {
    Grid grid;
    uint64_t bricks = 1;
    if (const auto size = in.find("size"))
        if (const auto items = size->items(3, 3); items.size() == 3)
            for (int axis = 0; axis < 3; ++axis) {
                grid.size[axis] = items[static_cast<size_t>(axis)].whole_number(1, kMostSide);
                bricks *= (grid.size[axis] + kBrickSide - 1) / kBrickSide;
            }
    if (bricks > kMostBricks)
        in.complain("expected a smaller volume");
    if (const auto matrix = in.find("world_from_index"))
        if (const auto items = matrix->items(12, 12); items.size() == 12)
            for (int i = 0; i < 12; ++i)
                grid.world_from_index[i % 4][i / 4] =
                    items[static_cast<size_t>(i)].number(-1e300, 1e300);
    return grid;
}

NotePages::Texts read_texts(const std::optional<JsonValue>& in) {
    NotePages::Texts texts;
    if (!in || !in->is(Json::Kind::object))
        return texts;
    for (const auto& [page, text] : in->json().members)
        texts[page] = text.string;
    return texts;
}

Result<PackedStep> parts_of(std::string_view packed) {
    const size_t end = packed.find('\n');
    if (end == packed.npos)
        return damaged();
    const Result<Json> json = parse_json(packed.substr(0, end), "history");
    if (!json)
        return damaged();
    packed.remove_prefix(end + 1);
    PackedStep found;
    JsonErrors errors{"history", {}};
    const JsonValue head(*json, "", errors);
    const bool has_notes = head.is(Json::Kind::object);
    if (has_notes) {
        found.notes_before = read_texts(head.find("notes_before"));
        found.notes_after = read_texts(head.find("notes_after"));
    }
    for (const JsonValue& in : (has_notes ? head.at("volumes") : head).items(0, 4096)) {
        PackedPart part;
        using enum VolumeStep::Kind;
        using enum ScalarType;
        const auto name = in.find("name"), what = in.find("what"), type = in.find("type"),
                   bytes = in.find("bytes"), kind = in.find("kind"), place = in.find("place");
        if (!name || !what || !type || !bytes)
            return damaged();
        part.step.name = name->text();
        part.step.kind = what->choice<VolumeStep::Kind>(
            {{kKindNames[0], changed}, {kKindNames[1], came}, {kKindNames[2], went}});
        part.step.type = type->choice<ScalarType>(
            {{"u8", u8}, {"i8", i8}, {"u16", u16}, {"i16", i16}, {"f32", f32}});
        if (part.step.kind != changed) {
            if (!kind || !place || !check_volume_name(part.step.name))
                return damaged();
            part.step.frame = {read_volume_kind(*kind), read_grid(in),
                               place->whole_number(0, 4096)};
        }
        const double size = bytes->number(0, static_cast<double>(packed.size()));
        part.bytes = packed.substr(0, static_cast<size_t>(size));
        packed.remove_prefix(part.bytes.size());
        found.parts.push_back(std::move(part));
    }
    if (errors.first || !packed.empty())
        return damaged();
    return found;
}

} // namespace

std::vector<ReplacedBrick> replaced_bricks(const Volume& before, const Volume& after) {
    std::vector<ChangedBrick> all;
    try {
        all = changed_bricks(before, after);
    } catch (const SourceError&) { // samples cannot be compared any more
        all = unshared_bricks(before, after);
    }
    std::vector<ReplacedBrick> bricks;
    for (const ChangedBrick& changed : all)
        bricks.push_back(
            {changed, before.brick_ptr(changed.position), after.brick_ptr(changed.position)});
    return bricks;
}

Volume taken_back(const Volume& before, const Volume& after) {
    std::vector<PlacedBrick> bricks;
    if (before.type() != after.type()) { // labels that have grown share no brick
        bricks.push_back({glm::uvec3(0), before.brick_ptr(glm::uvec3(0))});
        return with_bricks(before, bricks);
    }
    for (const ChangedBrick& brick : unshared_bricks(before, after))
        bricks.push_back({brick.position, before.brick_ptr(brick.position)});
    return with_bricks(after, bricks);
}

Step step_between(const Document& before, const Document& after) {
    Step step{.volumes = {},
              .notes_before = changes_between(after.notes, before.notes),
              .notes_after = changes_between(before.notes, after.notes)};
    const auto add = [&](VolumeStep::Kind kind, const Document& of, size_t place) {
        const NamedVolume& named = of.volumes[place];
        const Volume zeros = VolumeBuilder(named.volume.grid(), named.volume.type()).finish();
        const bool came = kind == VolumeStep::Kind::came;
        step.volumes.push_back(
            {kind,
             named.name,
             named.volume.type(),
             {named.kind, named.volume.grid(), place},
             came ? replaced_bricks(zeros, named.volume) : replaced_bricks(named.volume, zeros)});
    };
    const auto same_frame = [](const NamedVolume& a, const NamedVolume& b) {
        return a.name == b.name && a.kind == b.kind && a.volume.type() == b.volume.type() &&
               a.volume.grid() == b.volume.grid();
    };
    const auto stays_in = [&](const Document& other, const NamedVolume& volume) {
        return std::find_if(other.volumes.begin(), other.volumes.end(),
                            [&](const NamedVolume& v) { return same_frame(v, volume); });
    };
    for (size_t i = before.volumes.size(); i-- > 0;) // the last first: places stay what they were
        if (stays_in(after, before.volumes[i]) == after.volumes.end())
            add(VolumeStep::Kind::went, before, i);
    for (size_t i = 0; i < after.volumes.size(); ++i) {
        const NamedVolume& now = after.volumes[i];
        const auto was = stays_in(before, now);
        if (was == before.volumes.end())
            add(VolumeStep::Kind::came, after, i);
        else if (!was->volume.is_same_as(now.volume))
            if (auto bricks = replaced_bricks(was->volume, now.volume); !bricks.empty())
                step.volumes.push_back({VolumeStep::Kind::changed,
                                        now.name,
                                        now.volume.type(),
                                        {},
                                        std::move(bricks)});
    }
    return step;
}

Result<Document> apply_step(const Document& now, const Step& step, bool back) {
    const auto do_part = [&](Document& next, size_t i) {
        const VolumeStep& part = step.volumes[i];
        return apply_part(next, part, back, [&](const Volume& volume) -> Result<Volume> {
            std::vector<PlacedBrick> bricks;
            for (const ReplacedBrick& brick : part.bricks)
                bricks.push_back({brick.where.position, back ? brick.before : brick.after});
            return with_bricks(volume, bricks);
        });
    };
    return apply_parts(now, step.volumes.size(), back ? step.notes_before : step.notes_after, back,
                       do_part);
}

std::string pack_step(const Step& step) {
    Json list = Json::array();
    std::string all;
    for (const VolumeStep& part : step.volumes) {
        const std::string packed = packed_bricks(part.type, part.bricks);
        if (packed.empty()) // zstd had no memory
            return {};
        list.push_back(part_json(part, packed.size()));
        all += packed;
    }
    if (step.notes_after.empty()) // as steps without notes were always kept
        return json_line(list) + "\n" + all;
    const Json head{{"volumes", std::move(list)},
                    {"notes_before", texts_json(step.notes_before)},
                    {"notes_after", texts_json(step.notes_after)}};
    return json_line(head) + "\n" + all;
}

Result<Document> apply_packed_step(const Document& now, std::string_view packed, bool back) {
    PALPATE_TRY(const PackedStep step, parts_of(packed));
    const auto do_part = [&](Document& next, size_t i) {
        const PackedPart& part = step.parts[i];
        return apply_part(next, part.step, back, [&](const Volume& volume) {
            return with_packed_bricks(volume, part.bytes);
        });
    };
    return apply_parts(now, step.parts.size(), back ? step.notes_before : step.notes_after, back,
                       do_part);
}

} // namespace palpate
