#include "engine/segment/seeds.h"

#include <algorithm>
#include <cmath>

#include "engine/base/json.h"
#include "engine/base/json_value.h"
#include "engine/segment/task.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

constexpr double kFar = 1e7;           // mm
constexpr size_t kMostSeeds = 1 << 20; // of a file

Grid read_grid(const JsonValue& in) {
    in.only_keys({"size", "world_from_index"});
    Grid grid;
    const std::vector<JsonValue> size = in.at("size").items(3, 3);
    for (size_t i = 0; i < size.size(); ++i)
        grid.size[int(i)] = size[i].whole_number(1, 1u << 20);
    const std::vector<JsonValue> matrix = in.at("world_from_index").items(16, 16);
    for (size_t i = 0; i < matrix.size(); ++i)
        grid.world_from_index[int(i % 4)][int(i / 4)] = matrix[i].number(-kFar, kFar);
    return grid;
}

SeedBall read_ball(const JsonValue& in, const char* place, bool is_ball) {
    in.only_keys({"label", place, is_ball ? "radius_mm" : "label"});
    SeedBall ball;
    ball.label = static_cast<uint16_t>(in.at("label").whole_number(1, 65535));
    ball.center_mm = in.at(place).vector(-kFar, kFar);
    if (is_ball)
        ball.radius_mm = in.at("radius_mm").number(0.0, kFar);
    return ball;
}

WireCurve read_curve(const JsonValue& in) {
    in.only_keys({"label", "points_mm"});
    WireCurve curve;
    curve.label = static_cast<uint16_t>(in.at("label").whole_number(1, 65535));
    for (const JsonValue& point : in.at("points_mm").items(0, kMostSeeds))
        curve.points_mm.push_back(point.vector(-kFar, kFar));
    return curve;
}

std::string text_of(glm::dvec3 mm) {
    return fmt::format("({:g}, {:g}, {:g}) mm", mm.x, mm.y, mm.z);
}

bool inside(const Grid& grid, glm::dvec3 index) {
    return glm::all(glm::greaterThanEqual(index, glm::dvec3(-0.5 - 1e-9))) &&
           glm::all(glm::lessThanEqual(index, glm::dvec3(grid.size) - (0.5 - 1e-9)));
}

// Half the sides of the box of index space that holds a ball of radius 1 mm: the lengths of the
// rows of index_from_world.
glm::dvec3 reach_per_mm(const Grid& grid) {
    const glm::dmat3 rows = glm::transpose(glm::dmat3(index_from_world(grid)));
    return {glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2])};
}

// Calls put(index) for each sample of a ball; the nearest one where no centre lies within.
template <class Put>
void for_each_sample(const Grid& grid, const SeedBall& ball, const Put& put) {
    const glm::dvec3 center = index_point(grid, ball.center_mm);
    const glm::dvec3 reach = reach_per_mm(grid) * ball.radius_mm;
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    const glm::uvec3 low(glm::clamp(glm::ceil(center - reach), glm::dvec3(0.0), last));
    const glm::uvec3 high(glm::clamp(glm::floor(center + reach), glm::dvec3(0.0), last));
    const glm::dmat3 world(grid.world_from_index);
    bool any = false;
    for (uint32_t z = low.z; z <= high.z; ++z)
        for (uint32_t y = low.y; y <= high.y; ++y)
            for (uint32_t x = low.x; x <= high.x; ++x)
                if (glm::length(world * (glm::dvec3(x, y, z) - center)) <= ball.radius_mm) {
                    any = true;
                    put(glm::uvec3(x, y, z));
                }
    if (!any)
        put(glm::uvec3(glm::clamp(glm::round(center), glm::dvec3(0.0), last)));
}

} // namespace

Result<SeedFile> parse_seeds(std::string_view text, const std::string& name) {
    PALPATE_TRY(const Json json, parse_json(text, name));
    JsonErrors errors{name, {}};
    const JsonValue in(json, "", errors);
    in.only_keys({"seeds", "units", "background", "balls", "points", "curves", "of"});
    SeedFile file;
    in.at("seeds").whole_number(1, 1);
    in.at("units").choice<int>({{"mm", 0}});
    uint32_t background = 0;
    in.take("background", background, 1, 65535);
    file.background = static_cast<uint16_t>(background);
    if (const auto balls = in.find("balls"))
        for (const JsonValue& ball : balls->items(0, kMostSeeds))
            file.balls.push_back(read_ball(ball, "center_mm", true));
    if (const auto points = in.find("points"))
        for (const JsonValue& point : points->items(0, kMostSeeds))
            file.balls.push_back(read_ball(point, "at_mm", false));
    if (const auto curves = in.find("curves"))
        for (const JsonValue& curve : curves->items(0, kMostSeeds))
            file.curves.push_back(read_curve(curve));
    if (const auto grid = in.find("of"))
        file.grid = read_grid(*grid);
    if (errors.first)
        return tl::unexpected(*errors.first);
    if (file.balls.empty() && file.curves.empty())
        return fail(
            "{}: expected seeds under \"balls\" or \"points\", or curves under "
            "\"curves\", found none",
            name);
    if (file.background != 0 && std::ranges::none_of(file.balls, [&](const SeedBall& b) {
            return b.label == file.background;
        }))
        return fail("{}: label {} is the background, and no seed has it", name, file.background);
    return file;
}

std::string seeds_text(const SeedFile& seeds) {
    Json json{{"seeds", 1}, {"units", "mm"}};
    if (seeds.background != 0)
        json["background"] = seeds.background;
    Json balls = Json::array(), points = Json::array();
    for (const SeedBall& ball : seeds.balls)
        if (ball.radius_mm > 0.0)
            balls.push_back(Json{{"label", ball.label},
                                 {"center_mm", ball.center_mm},
                                 {"radius_mm", ball.radius_mm}});
        else
            points.push_back(Json{{"label", ball.label}, {"at_mm", ball.center_mm}});
    json["balls"] = balls;
    json["points"] = points;
    if (!seeds.curves.empty()) {
        Json curves = Json::array();
        for (const WireCurve& curve : seeds.curves) {
            Json places = Json::array();
            for (const glm::dvec3 p : curve.points_mm)
                places.push_back(p);
            curves.push_back(Json{{"label", curve.label}, {"points_mm", places}});
        }
        json["curves"] = curves;
    }
    if (seeds.grid) {
        const glm::uvec3 size = seeds.grid->size;
        Json matrix = Json::array();
        for (int i = 0; i < 16; ++i)
            matrix.push_back(seeds.grid->world_from_index[i % 4][i / 4]);
        json["of"] = Json{{"size", {size.x, size.y, size.z}}, {"world_from_index", matrix}};
    }
    return json_text(json);
}

Result<Volume> seed_map(const Volume& volume, std::span<const SeedBall> balls) {
    uint16_t largest = 0;
    for (const SeedBall& ball : balls)
        largest = std::max(largest, ball.label);
    const ScalarType type = largest < 256 ? ScalarType::u8 : ScalarType::u16;
    VolumeEdit edit(VolumeBuilder(volume.grid(), type).finish());
    for (const SeedBall& ball : balls) {
        if (!inside(volume.grid(), index_point(volume.grid(), ball.center_mm)))
            return fail("the seed of label {} at {} lies outside the volume, which holds {}",
                        ball.label, text_of(ball.center_mm),
                        text_of(world_box(volume.grid(), 0.5)));
        bool any = false;
        for_each_sample(volume.grid(), ball, [&](glm::uvec3 index) {
            if (std::isnan(volume.value(index)))
                return;
            any = true;
            edit.set(index, ball.label);
        });
        if (!any)
            return fail("the seed of label {} at {} lies where the volume has no data", ball.label,
                        text_of(ball.center_mm));
    }
    return edit.commit();
}

Result<Volume> seed_map(const Volume& volume, const SeedFile& seeds, const std::string& name) {
    const auto same = [](const Grid& a, const Grid& b) {
        if (a.size != b.size)
            return false;
        // As far apart as their corners, at most.
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 at =
                glm::dvec3(a.size - 1u) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
            if (glm::length(world_point(a, at) - world_point(b, at)) >
                0.01 * smallest_spacing_mm(a))
                return false;
        }
        return true;
    };
    if (seeds.grid && !same(*seeds.grid, volume.grid()))
        return fail(
            "{}: made for a volume of {} x {} x {} samples that holds {}; this one has {} x {} x "
            "{} samples and holds {}",
            name, seeds.grid->size.x, seeds.grid->size.y, seeds.grid->size.z,
            text_of(world_box(*seeds.grid, 0.5)), volume.size().x, volume.size().y, volume.size().z,
            text_of(world_box(volume.grid(), 0.5)));
    const Result<Volume> map = seed_map(volume, seeds.balls);
    if (!map)
        return fail("{}: {}", name, map.error().message);
    return map;
}

Result<Volume> checked_seeds(const Volume& volume, const Volume& seeds, const std::string& name) {
    const Grid &a = seeds.grid(), &b = volume.grid();
    if (a.size != b.size)
        return fail(
            "{}: expected seeds on the grid of the volume, {} x {} x {} samples, found {} "
            "x {} x {}",
            name, b.size.x, b.size.y, b.size.z, a.size.x, a.size.y, a.size.z);
    const double off = glm::length(world_point(a, glm::dvec3(a.size - 1u)) -
                                   world_point(b, glm::dvec3(a.size - 1u))) +
                       glm::length(world_point(a, {}) - world_point(b, {}));
    if (off > 0.02 * smallest_spacing_mm(b))
        return fail("{}: expected seeds on the grid of the volume, which holds {}, found {}", name,
                    text_of(world_box(b, 0.5)), text_of(world_box(a, 0.5)));
    if (seeds.type() != ScalarType::u8 && seeds.type() != ScalarType::u16)
        return fail("{}: expected a label map of type u8 or u16, found {}", name,
                    name_of(seeds.type()));
    if (!(seeds.range().max > 0.0f))
        return fail("{}: expected seeds, found a label map of zeros", name);
    if (volume.no_data_count() == 0)
        return seeds;
    VolumeEdit edit(seeds);
    for_each_brick(seeds, [&](glm::uvec3 position) {
        const Brick& labels = seeds.brick(position);
        const Brick& grey = volume.brick(position);
        if (labels.range().max == 0.0f || grey.no_data_count() == 0)
            return;
        const Brick::Pinned pinned = grey.pin(), label_pin = labels.pin();
        const glm::uvec3 valid = seeds.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const uint32_t at = offset_in_brick({x, y, z});
                    if (labels.value(label_pin, at) != 0.0f && std::isnan(grey.value(pinned, at)))
                        edit.set(position * kBrickSide + glm::uvec3(x, y, z), 0.0);
                }
    });
    const Volume cleaned = edit.commit();
    if (!(cleaned.range().max > 0.0f))
        return fail("{}: all seeds lie where the volume has no data", name);
    return cleaned;
}

std::vector<LabelCount> label_counts(const Volume& labels) {
    std::vector<uint64_t> counts(65536);
    for_each_brick(labels, [&](glm::uvec3 position) {
        const Brick& brick = labels.brick(position);
        if (brick.range().max == 0.0f)
            return;
        const Brick::Pinned pinned = brick.pin();
        const glm::uvec3 valid = labels.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x)
                    ++counts[size_t(brick.value(pinned, offset_in_brick({x, y, z})))];
    });
    std::vector<LabelCount> found;
    for (size_t label = 1; label < counts.size(); ++label)
        if (counts[label] > 0)
            found.push_back({static_cast<uint16_t>(label), counts[label]});
    return found;
}

} // namespace palpate
