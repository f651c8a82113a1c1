#include "bench/suite/surface_cases.h"

#include <algorithm>
#include <set>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"

namespace palpate::bench {

namespace {

// `side` samples an axis over 100 mm.
SurfaceCase sampled(const synthetic::Field& field, uint32_t side, const std::string& name) {
    const Grid grid = make_grid(glm::uvec3(side), glm::dvec3(100.0 / (side - 1.0)));
    return {{fmt::format("{}_{}", name, side), fmt::format("{}, {}^3", name, side),
             synthetic::sample(field, grid, ScalarType::f32)},
            0.0,
            false,
            field};
}

Result<SurfaceCase> label_case(const std::string& name, const fs::path& path) {
    PALPATE_TRY(const LoadedVolume loaded, load_labels(path.string()));
    const Volume& volume = loaded.volume;
    return SurfaceCase{{name, path.filename().string(),
                        with_grid(volume, make_grid(volume.size(), spacing_mm(volume.grid())))},
                       0.0,
                       true,
                       {}};
}

} // namespace

bool is_asked(const Options& options, const std::string& part) {
    return options.only.empty() ||
           std::find(options.only.begin(), options.only.end(), part) != options.only.end();
}

Result<std::vector<NamedCase>> surface_cases(const Options& options) {
    std::vector<NamedCase> cases;
    std::set<std::string> usual; // run where --only names none
    const auto add = [&](const std::string& name, bool is_usual,
                         std::function<Result<SurfaceCase>()> make) {
        cases.push_back({name, std::move(make)});
        if (is_usual)
            usual.insert(name);
    };
    for (const uint32_t side : {16u, 32u, 64u, 128u, 256u}) {
        const bool is_usual =
            options.tiny ? side <= 32 : side >= 32 && (side < 256 || options.full);
        add(fmt::format("sphere_{}", side), is_usual, [side]() -> Result<SurfaceCase> {
            return sampled(synthetic::sphere_distance(glm::dvec3(50.0), 35.0), side, "sphere");
        });
        add(fmt::format("gyroid_{}", side), is_usual, [side]() -> Result<SurfaceCase> {
            return sampled(synthetic::gyroid(25.0), side, "gyroid");
        });
    }
    add("head_ct", !options.tiny, [=]() -> Result<SurfaceCase> {
        PALPATE_TRY(Sample ct, head_ct(options.head_ct));
        return SurfaceCase{std::move(ct), 300.0, false, {}};
    });
    add("head_ct_174", !options.tiny, [=]() -> Result<SurfaceCase> {
        PALPATE_TRY(const Sample ct, head_ct(options.head_ct));
        return SurfaceCase{resampled(ct, {512, 512, 174}, "head_ct_174"), 300.0, false, {}};
    });
    // Eight periods across, 12.5 mm each.
    add("gyroid_512", options.full, []() -> Result<SurfaceCase> {
        SurfaceCase made = sampled(synthetic::gyroid(12.5), 512, "gyroid");
        made.field.reset();
        made.for_time = true;
        return made;
    });
    add("labels", !options.tiny, [=] { return label_case("labels", options.labels); });

    std::string known;
    for (const NamedCase& one : cases)
        known += one.name + ", ";
    for (const std::string& part : options.only)
        if (part != kEditsPart && part != kWindowPart && part != kLivePart &&
            std::none_of(cases.begin(), cases.end(),
                         [&](const NamedCase& one) { return one.name == part; }))
            return fail("--only: expected {}{}, {} or {}, found '{}'", known, kEditsPart,
                        kWindowPart, kLivePart, part);
    std::erase_if(cases, [&](const NamedCase& one) {
        return options.only.empty() ? !usual.contains(one.name) : !is_asked(options, one.name);
    });
    return cases;
}

std::vector<double> labels_in(const Volume& volume) {
    std::set<float> found;
    std::vector<float> row(volume.size().x);
    for (uint32_t z = 0; z < volume.size().z; ++z)
        for (uint32_t y = 0; y < volume.size().y; ++y) {
            read_row(volume, {0, y, z}, volume.size().x, row.data());
            found.insert(row.begin(), row.end());
        }
    found.erase(0.0f);
    return {found.begin(), found.end()};
}

} // namespace palpate::bench
