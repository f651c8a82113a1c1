#include "engine/volume/synthetic_name.h"

#include <charconv>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/base/memory_limit.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate {

namespace {

constexpr std::string_view kPrefix = "synthetic:";

struct Recipe {
    std::string_view name;
    double half_extent_mm;
    ScalarType type;
    synthetic::Field (*field)();
};

// Maps a field onto 0 .. 1000.
synthetic::Field scaled(synthetic::Field field, double offset, double scale) {
    return {[=](glm::dvec3 p) { return offset + scale * field.value(p); },
            [=](glm::dvec3 p) { return scale * field.gradient(p); }};
}

const Recipe kRecipes[] = {
    {"phantom", 100.0, ScalarType::i16, [] { return synthetic::ct_phantom(); }},
    {"ball", 50.0, ScalarType::i16, [] { return synthetic::sphere({}, 35.0, 1.5); }},
    {"gyroid", 50.0, ScalarType::i16,
     [] { return scaled(synthetic::gyroid(50.0), 500.0, 1000.0 / 3.0); }},
    {"torus", 50.0, ScalarType::i16,
     [] { return scaled(synthetic::torus({}, 28.0, 12.0), 500.0, 20.0); }},
    {"gaussian", 50.0, ScalarType::i16, [] { return synthetic::gaussian({}, 15.0); }},
    {"marschner-lobb", 1.0, ScalarType::f32, [] { return synthetic::marschner_lobb(1.0); }},
    {"shells", 50.0, ScalarType::i16,
     [] { return scaled(synthetic::shells({}, 20.0), 0.0, 1000.0); }},
    {"ramp", 50.0, ScalarType::f32,
     [] {
         return synthetic::ramp({10.0, 0.0, 0.0}, 500.0);
     }},
    {"slab", 50.0, ScalarType::i16,
     [] {
         return synthetic::slab({}, {0.0, 0.0, 1.0}, 20.0, 1.0);
     }},
    {"sheet", 50.0, ScalarType::i16,
     [] {
         return synthetic::thin_sheet({}, {1.0, 0.5, 0.25}, 1.0);
     }},
    {"checkerboard", 50.0, ScalarType::u8, [] { return synthetic::checkerboard(12.5, 8); }},
};

// "N" or "X,Y,Z" within low .. high.
std::optional<glm::dvec3> three_numbers(std::string_view text, double low, double high) {
    std::vector<double> values;
    while (!text.empty() && values.size() < 4) {
        double value = 0;
        const auto [next, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc() || !(value >= low && value <= high))
            return std::nullopt;
        values.push_back(value);
        text.remove_prefix(static_cast<size_t>(next - text.data()));
        if (!text.empty() && (text.front() != ',' || text.size() == 1))
            return std::nullopt;
        if (!text.empty())
            text.remove_prefix(1);
    }
    if (values.size() == 1)
        return glm::dvec3(values[0]);
    if (values.size() != 3)
        return std::nullopt;
    return glm::dvec3(values[0], values[1], values[2]);
}

} // namespace

Result<SyntheticVolume> find_synthetic(const std::string& name) {
    std::string_view rest = name;
    if (!rest.starts_with(kPrefix))
        return fail("{}: expected a name that starts with '{}'", name, kPrefix);
    rest.remove_prefix(kPrefix.size());
    const std::string_view kind = rest.substr(0, rest.find('?'));
    rest.remove_prefix(std::min(rest.size(), kind.size() + 1));

    const Recipe* recipe = nullptr;
    std::string known;
    for (const Recipe& candidate : kRecipes) {
        if (candidate.name == kind)
            recipe = &candidate;
        known += (known.empty() ? "" : ", ") + std::string(candidate.name);
    }
    if (!recipe)
        return fail("{}: expected one of {}, found '{}'", name, known, kind);

    glm::dvec3 size(64.0), ratio(1.0);
    ScalarType type = recipe->type;
    while (!rest.empty()) {
        const std::string_view pair = rest.substr(0, rest.find('&'));
        rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
        const std::string_view key = pair.substr(0, pair.find('='));
        const std::string_view value = pair.substr(std::min(pair.size(), key.size() + 1));
        if (key == "size") {
            const auto found = three_numbers(value, 1.0, 4096.0);
            if (!found || *found != glm::floor(*found))
                return fail("{}: expected size=N or size=X,Y,Z with 1 .. 4096 samples, found '{}'",
                            name, pair);
            size = *found;
        } else if (key == "spacing") {
            const auto found = three_numbers(value, 1e-3, 1e3);
            if (!found)
                return fail("{}: expected spacing=X,Y,Z with ratios of 0.001 .. 1000, found '{}'",
                            name, pair);
            ratio = *found;
        } else if (key == "type") {
            if (value == "u16" && recipe->type == ScalarType::i16)
                type = ScalarType::u16;
            else if (value != name_of(recipe->type))
                return fail("{}: expected type={}{}, found '{}'", name, name_of(recipe->type),
                            recipe->type == ScalarType::i16 ? " or type=u16" : "", pair);
        } else {
            return fail("{}: expected the keys size, spacing and type, found '{}'", name, pair);
        }
    }
    // The finest spacing that still covers the field on every axis.
    const glm::dvec3 intervals = glm::max(size - 1.0, glm::dvec3(1.0));
    const glm::dvec3 needed = 2.0 * recipe->half_extent_mm / (intervals * ratio);
    const glm::dvec3 spacing = ratio * std::max({needed.x, needed.y, needed.z});
    const Grid grid = make_grid(glm::uvec3(size), spacing, -0.5 * (size - 1.0) * spacing);
    const double noise_sigma = recipe->name == "phantom" ? synthetic::kCtNoise_hu : 0.0;
    const double offset = type == ScalarType::u16 ? 1024.0 : 0.0;
    return SyntheticVolume{
        grid, type,
        [grid, noise_sigma, offset, field = recipe->field()](glm::uvec3 index) {
            const double value = field.value(world_point(grid, glm::dvec3(index))) + offset;
            return noise_sigma > 0.0 ? value + noise_sigma * synthetic::noise(index, 1) : value;
        },
        type == ScalarType::u8};
}

Result<Volume> make_synthetic(const std::string& name, uint64_t limit_bytes) {
    PALPATE_TRY(const SyntheticVolume found, find_synthetic(name));
    const uint64_t bytes = sample_count(found.grid) * bytes_per_sample(found.type);
    PALPATE_TRY(expect_memory(name, static_cast<double>(bytes), limit_bytes));
    return make_volume(found.grid, found.type, found.value);
}

} // namespace palpate
