#include "apps/palpate/seed_options.h"

#include <filesystem>

#include "apps/palpate/edit_replay.h"
#include "engine/base/file.h"
#include "engine/edit/stroke.h"
#include "engine/program/read_options.h"
#include "engine/volume/builder.h"

namespace palpate {

namespace {

Result<Volume> seeds_of_strokes(const std::string& path, const Volume& volume,
                                const Interrupt& interrupt) {
    PALPATE_TRY(const std::string text, load_text(path, uint64_t{1} << 30));
    PALPATE_TRY(std::vector<Stroke> strokes, parse_strokes(text, path));
    Replay replay(
        Document(VolumeBuilder(volume.grid(), ScalarType::u8).finish(), VolumeKind::labels), {});
    for (Stroke& stroke : strokes) {
        if (!stroke.operation.on_labels() || stroke.operation.only_values)
            return fail("{}: expected strokes that draw or erase labels, found '{}'{}", path,
                        name_of(stroke.operation.kind),
                        stroke.operation.only_values ? " by values" : "");
        PALPATE_TRY(replay.apply({JournalEntry::Kind::stroke, std::move(stroke), "volume", "", {}},
                                 interrupt.token()));
    }
    return replay.volume();
}

} // namespace

Result<ReadSeeds> read_seeds(const std::string& path, const Volume& volume, double max_memory_mib,
                             const Interrupt& interrupt) {
    const std::string extension = std::filesystem::path(path).extension();
    if (extension == ".json") {
        PALPATE_TRY(const std::string text, load_text(path));
        PALPATE_TRY(SeedFile file, parse_seeds(text, path));
        PALPATE_TRY(Volume map, seed_map(volume, file, path));
        return ReadSeeds{std::move(map), std::move(file.balls), file.background,
                         std::move(file.curves)};
    }
    if (extension == ".jsonl") {
        PALPATE_TRY(const Volume drawn, seeds_of_strokes(path, volume, interrupt));
        PALPATE_TRY(Volume map, checked_seeds(volume, drawn, path));
        return ReadSeeds{std::move(map), {}, 0};
    }
    ReadFlags flags;
    flags.path = path;
    flags.max_memory_mib = max_memory_mib;
    PALPATE_TRY(const LoadedVolume loaded, load(flags, true, interrupt));
    PALPATE_TRY(Volume map, checked_seeds(volume, loaded.volume, path));
    return ReadSeeds{std::move(map), {}, 0};
}

} // namespace palpate
