#include "tests/unit/segment_tables/volumes.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/segment/seeds.h"
#include "engine/volume/builder.h"
#include "engine/volume/grid.h"

namespace palpate::tables {

namespace {

Grid turned(glm::uvec3 size, glm::dvec3 spacing, bool sheared) {
    const double c = 0.8, s = 0.6;
    glm::dmat3 axes =
        glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1) * glm::dmat3(1, 0, 0, 0, c, s, 0, -s, c);
    if (sheared)
        axes[2] = glm::normalize(axes[2] + 0.3 * axes[1]);
    Grid grid = make_grid(size, {1, 1, 1}, {-40, 25, 310});
    for (int a = 0; a < 3; ++a)
        grid.world_from_index[a] = glm::dvec4(axes[a] * spacing[a], 0);
    return grid;
}

Grid mirrored(glm::uvec3 size, glm::dvec3 spacing) {
    Grid grid = make_grid(size, spacing, {5, 6, 7});
    grid.world_from_index[1] *= -1.0;
    return grid;
}

// A ball of 100 in 0 with noise of 20 to each side, or with labels a ball and slabs with gaps.
double value_at(glm::uvec3 i, glm::uvec3 size, bool labels) {
    uint32_t random = i.x * 73856093u ^ i.y * 19349663u ^ i.z * 83492791u;
    random = (random ^ random >> 15) * 0x2c1b3c6du;
    random ^= random >> 12;
    const glm::dvec3 d = (glm::dvec3(i) - 0.5 * glm::dvec3(size - 1u)) / glm::dvec3(size);
    const bool ball = glm::length(d) < 0.3;
    if (labels)
        return random % 20 == 0 ? 0.0 : ball ? 1.0 : (i.x / 9 + i.y / 7) % 2 * 2.0;
    return (ball ? 100.0 : 0.0) + double(random % 41) - 20.0;
}

} // namespace

Volume sampled(const Grid& grid, ScalarType type, bool labels) {
    return make_volume(grid, type,
                       [&, size = grid.size](glm::uvec3 i) { return value_at(i, size, labels); });
}

std::vector<VolumeCase> volumes(bool labels) {
    const glm::dvec3 unequal(0.7, 0.9, 2.0);
    const glm::uvec3 size(40, 21, 10); // two bricks along x
    const auto of = [&](const Grid& grid, ScalarType type = ScalarType::i16) {
        return sampled(grid, type, labels);
    };
    const auto constant = [&](ScalarType type, double value) {
        return make_volume(make_grid(size, unequal), type, [=](glm::uvec3) { return value; });
    };
    return {
        {"u8", of(make_grid(size, unequal), ScalarType::u8)},
        {"i16", of(make_grid(size, unequal))},
        {"u16, equal spacing", of(make_grid(size, {1, 1, 1}), ScalarType::u16)},
        {"f32", of(make_grid(size, unequal), ScalarType::f32)},
        {"turned", of(turned(size, unequal, false))},
        {"mirrored", of(mirrored(size, unequal))},
        {"sheared", of(turned(size, unequal, true)), true},
        {"thin along x", of(make_grid({1, 34, 9}, unequal))},
        {"thin along y", of(make_grid({35, 1, 9}, unequal))},
        {"thin along z", of(make_grid({35, 12, 1}, unequal))},
        {"a line", of(make_grid({1, 40, 1}, unequal))},
        {"a sample", of(make_grid({1, 1, 1}, unequal))},
        {"constant", constant(ScalarType::i16, 3.0)},
        {"0", constant(ScalarType::u8, 0.0)},
        {"without data in patches",
         make_volume(make_grid(size, unequal), ScalarType::f32,
                     [&](glm::uvec3 i) {
                         const bool patch = (i.x > 28 && i.y > 12) || (i.x + i.y + i.z) % 11 == 0;
                         return patch ? std::nan("") : value_at(i, size, labels);
                     })},
        {"without data", constant(ScalarType::f32, std::nan(""))},
    };
}

std::map<std::string, Volume> others_of(const Volume& volume) {
    const Grid& grid = volume.grid();
    return {{"b", make_volume(grid, ScalarType::u8, [](glm::uvec3 i) { return i.x % 3; })},
            {"other", sampled({grid.size + 1u, grid.world_from_index}, ScalarType::i16, false)}};
}

std::vector<FilterUse> uses_of(const Filter& filter, const std::map<std::string, Volume>& others) {
    const std::string name = filter.name;
    if (filter.text[0] != '\0') {
        const std::map<std::string, std::string> texts{
            {"expression", "where(has(b) && a > 2, a - 2*b, sqrt(abs(a)))"},
            {"logic", "intersect,1,2,b"},
            {"mask", "b,5"},
            {"reorient", "SLA"},
            {"resample-like", "other,cubic"},
            {"scissors",
             R"({"scissors": 1, "units": "mm", "action": "erase-outside", "all_labels": true,
                 "outline_mm": [[-9, -9, 0], [12, -9, 1], [12, 20, 0]], "towards": [0.1, 0.2, 1],
                 "eye_mm": [3, 4, -50], "depths_mm": [-30, 30], "seen_first": true})"}};
        return {{name, {{}, texts.at(name), &others}}};
    }
    std::vector<double> values;
    for (const FilterParameter& p : filter.parameters)
        values.push_back(p.preset.value_or(p.words[0] != '\0'                   ? 0.0
                                           : std::string_view(p.name) == "high" ? 2.0
                                           : name == "crop"                     ? 0.0
                                           : name == "hollow"                   ? 2.0
                                                                                : 1.0));
    std::vector<FilterUse> uses{{name, {values, "", &others}}};
    for (size_t p = 0; p < values.size(); ++p)
        if (const std::string words = filter.parameters[p].words; !words.empty())
            for (size_t w = 1; w <= size_t(std::count(words.begin(), words.end(), '|')); ++w) {
                std::vector<double> one = values;
                one[p] = double(w);
                uses.push_back(
                    {fmt::format("{}, {} {} of {}", name, filter.parameters[p].name, w, words),
                     {one, "", &others}});
            }
    return uses;
}

SegmentInput input_of(const SegmentMethod& method, const Volume& volume) {
    if (!method.takes_seeds)
        return SegmentInput{volume, {}, {}, 0};
    const glm::uvec3 middle = volume.size() / 2u;
    const Volume seeds = make_volume(volume.grid(), ScalarType::u8, [&](glm::uvec3 i) {
        const glm::ivec3 off = glm::abs(glm::ivec3(i) - glm::ivec3(middle));
        if (std::max({off.x, off.y, off.z}) <= 1)
            return 1.0;
        return std::max({i.x, i.y, i.z}) <= 1 ? 2.0 : 0.0;
    });
    return SegmentInput{volume, seeds, {}, uint16_t(seeds.range().max > 1.0f ? 2 : 0)};
}

ParameterValues values_of(const SegmentMethod& method) {
    const auto has = [&](std::string_view name) {
        return std::ranges::any_of(method.parameters,
                                   [&](const MethodParameter& p) { return name == p.name; });
    };
    ParameterValues values;
    if (!method.takes_seeds && has("low"))
        values["low"] = 50.0;
    if (has("rule")) // a front meets no boundary in some of the volumes
        values["threshold"] = 20.0;
    if (has("edges")) { // of a mesh: few vertices and steps will do
        values["edges"] = 0.0;
        values["subdivisions"] = 2.0;
        values["steps"] = 40.0;
    }
    if (has("tolerance"))
        values["tolerance"] = 1e-2;
    return values;
}

testing::AssertionResult same(const Result<Volume>& a, const Result<Volume>& b) {
    if (!a || !b)
        return a || b || a.error().message != b.error().message
                   ? testing::AssertionFailure()
                         << "'" << (a ? "made" : a.error().message) << "' and '"
                         << (b ? "made" : b.error().message) << "'"
                   : testing::AssertionSuccess();
    if (a->type() != b->type() || a->grid() != b->grid())
        return testing::AssertionFailure() << "another grid or type";
    const glm::uvec3 size = a->size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                const float u = a->value({x, y, z}), v = b->value({x, y, z});
                if (std::memcmp(&u, &v, sizeof u) != 0 && !(std::isnan(u) && std::isnan(v)))
                    return testing::AssertionFailure()
                           << u << " and " << v << " at " << x << ", " << y << ", " << z;
            }
    return testing::AssertionSuccess();
}

std::string test_name(std::string row) {
    std::replace(row.begin(), row.end(), '-', '_');
    return row;
}

bool says_sheared(const std::string& message) {
    for (const char* word : {"perpendicular", "right angles", "sheared"})
        if (message.find(word) != std::string::npos)
            return true;
    return false;
}

} // namespace palpate::tables
