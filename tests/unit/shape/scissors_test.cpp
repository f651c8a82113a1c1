#include "engine/segment/scissors.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>

#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

// Turned, with uneven spacing, one of its axes mirrored; and one along the axes of the patient.
std::array<Grid, 2> cut_grids() {
    const glm::uvec3 size(37, 9, 11);
    glm::dmat4 turned = glm::rotate(glm::dmat4(1.0), 0.7, glm::dvec3(0.3, -0.5, 0.8));
    turned = glm::scale(turned, glm::dvec3(0.7, -1.1, 2.3));
    turned[3] = glm::dvec4(12.0, -30.0, 55.0, 1.0);
    return {make_grid(size, glm::dvec3(0.8), glm::dvec3(-10.0, 4.0, 7.0)), Grid{size, turned}};
}

Volume as_wide(const Volume& labels) {
    std::vector<uint16_t> samples;
    for (const float one : samples_of(labels))
        samples.push_back(static_cast<uint16_t>(300.0f * one));
    return make_volume<uint16_t>(labels.grid(), samples);
}

// An outline in a plane across the direction of view, as its maker knows it.
struct DrawnOutline {
    glm::dvec3 middle, right, up;
    std::vector<glm::dvec2> corners; // by `right` and `up`, from the middle

    glm::dvec3 place(glm::dvec2 at) const { return middle + at.x * right + at.y * up; }
    // Whether a place lies within: a line towards +y crosses the outline an odd number of times.
    bool holds(glm::dvec2 at) const {
        int crossed = 0;
        for (size_t i = 0; i < corners.size(); ++i) {
            const glm::dvec2 a = corners[i], b = corners[(i + 1) % corners.size()];
            if (std::min(a.x, b.x) <= at.x && at.x < std::max(a.x, b.x) &&
                a.y + (b.y - a.y) * (at.x - a.x) / (b.x - a.x) > at.y)
                ++crossed;
        }
        return crossed % 2 == 1;
    }
};

struct CutCase {
    DrawnOutline drawn;
    Scissors scissors;
};

CutCase random_case(const Grid& grid, bool from_eye, std::mt19937& random) {
    std::uniform_real_distribution<double> real(-1.0, 1.0);
    const glm::dvec3 towards =
        glm::normalize(glm::dvec3(real(random), real(random), 1.2 + real(random)));
    CutCase made;
    DrawnOutline& drawn = made.drawn;
    drawn.middle = center_mm(grid) + 3.0 * glm::dvec3(real(random), real(random), real(random));
    drawn.right = glm::normalize(glm::cross(towards, glm::dvec3(0.2, 1.0, 0.1)));
    drawn.up = glm::cross(drawn.right, towards);
    // Crosses itself: a person draws by hand.
    const int count = 3 + int(random() % 30);
    for (int i = 0; i < count; ++i)
        drawn.corners.emplace_back(12.0 * real(random), 12.0 * real(random));
    Scissors& s = made.scissors;
    s.towards = 2.5 * towards;
    if (from_eye)
        s.eye_mm = drawn.middle - (5.0 + 30.0 * std::abs(real(random))) * towards +
                   4.0 * real(random) * drawn.right;
    for (const glm::dvec2 corner : drawn.corners)
        s.outline_mm.push_back(drawn.place(corner));
    return made;
}

// The place in the plane of the outline on the ray of a point; none behind the eye.
std::optional<glm::dvec2> place_seen(const CutCase& c, glm::dvec3 point) {
    const glm::dvec3 normal = glm::cross(c.drawn.right, c.drawn.up);
    glm::dvec3 ray = normal;
    if (c.scissors.eye_mm) {
        ray = point - *c.scissors.eye_mm;
        if (glm::dot(ray, c.scissors.towards) <= 0.0)
            return std::nullopt;
    }
    const double t = glm::dot(normal, c.drawn.middle - point) / glm::dot(normal, ray);
    const glm::dvec3 at = point + t * ray - c.drawn.middle;
    return glm::dvec2(glm::dot(at, c.drawn.right), glm::dot(at, c.drawn.up));
}

// Whether the line from a sample to the eye meets boxes of samples that are in the set, and from
// the first one that is not only samples of 0. Every box of the volume is clipped against the line
// by itself.
bool is_first_seen(const CutCase& c, const Grid& grid, const std::vector<bool>& in_set,
                   const std::vector<float>& labels, size_t sample) {
    const glm::dvec3 from(index_of(grid.size, sample));
    const glm::dvec3 point = world_point(grid, from);
    const glm::dvec3 end =
        c.scissors.eye_mm ? *c.scissors.eye_mm : point - 1e4 * glm::normalize(c.scissors.towards);
    const glm::dvec3 by = index_point(grid, end) - from;
    std::map<double, size_t> met; // by where the line enters
    for (size_t n = 0; n < in_set.size(); ++n) {
        const glm::dvec3 box(index_of(grid.size, n));
        double in = 0.0, out = 1.0;
        for (int a = 0; a < 3; ++a) {
            const double one = (box[a] - 0.5 - from[a]) / by[a],
                         two = (box[a] + 0.5 - from[a]) / by[a];
            in = std::max(in, std::min(one, two));
            out = std::min(out, std::max(one, two));
        }
        if (in < out)
            met[in] = n;
    }
    bool has_left = false;
    for (const auto& [where, n] : met) {
        has_left = has_left || !in_set[n];
        if (has_left && labels[n] != 0.0f)
            return false;
    }
    return true;
}

// Every sample of a cut as its definition has it.
std::vector<float> cut_twin(const Volume& map, const CutCase& c, uint16_t locked) {
    const Scissors& s = c.scissors;
    const Grid& grid = map.grid();
    const std::vector<float> before = samples_of(map);
    std::vector<float> after = before;
    const bool fills = s.action == ScissorsAction::fill_inside;
    std::vector<bool> may(before.size());
    for (size_t n = 0; n < before.size(); ++n) {
        const float own = before[n];
        may[n] = own != float(locked) && (fills          ? (own == 0.0f || s.all_labels)
                                          : s.all_labels ? own != 0.0f
                                                         : own == float(s.label));
    }
    for (size_t n = 0; n < before.size(); ++n) {
        const glm::dvec3 point = world_point(grid, glm::dvec3(index_of(grid.size, n)));
        const auto at = place_seen(c, point);
        const bool inside = at && c.drawn.holds(*at);
        const double depth = glm::dot(point - s.outline_mm[0], glm::normalize(s.towards));
        if (may[n] && inside == (s.action != ScissorsAction::erase_outside) &&
            (!s.depths_mm || (s.depths_mm->first <= depth && depth <= s.depths_mm->second)) &&
            (!s.seen_first || is_first_seen(c, grid, may, before, n)))
            after[n] = fills ? float(s.label) : 0.0f;
    }
    return after;
}

TEST(Scissors, CutWhatTheirDefinitionSays) {
    std::mt19937 random(5);
    size_t changed = 0, hidden = 0;
    for (const Grid& grid : cut_grids())
        for (int round = 0; round < 36; ++round) {
            const Volume drawn = random_labels(grid, 4, 0.85, random());
            const bool is_wide = round % 2 == 1;
            const Volume map = is_wide ? as_wide(drawn) : drawn;
            const auto unit = static_cast<uint16_t>(is_wide ? 300 : 1);
            CutCase c = random_case(grid, round % 4 < 2, random);
            Scissors& s = c.scissors;
            s.action = ScissorsAction(round % 3);
            s.label = unit;
            s.all_labels = random() % 2 == 0;
            if (round % 5 < 2)
                s.depths_mm = {-3.0, 2.5};
            s.seen_first = s.action != ScissorsAction::fill_inside && round % 6 < 4;
            const std::array locked{static_cast<uint16_t>(3 * unit)};
            const Result<Volume> made = cut_labels(map, s, locked, {});
            ASSERT_TRUE(made) << made.error().message;
            EXPECT_EQ(made->type(), map.type());
            const std::vector<float> got = samples_of(*made), before = samples_of(map);
            ASSERT_EQ(got, cut_twin(map, c, locked[0])) << "round " << round;
            for (size_t n = 0; n < got.size(); ++n)
                changed += got[n] != before[n];
            if (s.seen_first) {
                s.seen_first = false;
                const std::vector<float> all = samples_of(*cut_labels(map, s, locked, {}));
                for (size_t n = 0; n < got.size(); ++n)
                    hidden += got[n] != all[n];
            }
        }
    EXPECT_GT(changed, 10000u) << "the cases cut much";
    EXPECT_GT(hidden, 1000u) << "and some of it is hidden from the eye";
}

// A plate before another one is cut, and the other stays behind it.
TEST(Scissors, OfTwoPlatesTheFirstIsSeenFirst) {
    const Grid grid = make_grid({20, 20, 20}, glm::dvec3(1.0, 1.0, 2.0));
    const Volume map = make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
        return i.z >= 4 && i.z < 7 ? 1.0 : i.z >= 12 && i.z < 15 ? 1.0 : 0.0;
    });
    Scissors s{.outline_mm = {{4.5, 4.5, 0}, {9.5, 4.5, 0}, {9.5, 9.5, 0}, {4.5, 9.5, 0}},
               .towards = {0.0, 0.0, 1.0},
               .seen_first = true};
    const Result<Volume> from_below = cut_labels(map, s, {}, {});
    s.towards = {0.0, 0.0, -1.0};
    const Result<Volume> from_above = cut_labels(map, s, {}, {});
    for (size_t n = 0; n < sample_count(grid); ++n) {
        const glm::uvec3 i = index_of(grid.size, n);
        const bool inside = i.x >= 5 && i.x < 10 && i.y >= 5 && i.y < 10;
        const float was = map.value(i);
        EXPECT_EQ(from_below->value(i), inside && i.z < 10 ? 0.0f : was);
        EXPECT_EQ(from_above->value(i), inside && i.z >= 10 ? 0.0f : was);
    }
}

// A plate of another label hides a plate, whether it is locked or not.
TEST(Scissors, OtherLabelsHide) {
    const Volume map =
        make_volume(make_grid({8, 8, 12}, glm::dvec3(1.0)), ScalarType::u8, [](glm::uvec3 i) {
            return i.z == 3 ? (i.x < 4 ? 2.0 : 0.0) : i.z == 8 ? 1.0 : 0.0;
        });
    const Scissors s{.outline_mm = {{-9, -9, 0}, {20, -9, 0}, {20, 20, 0}, {-9, 20, 0}},
                     .seen_first = true};
    for (const std::vector<uint16_t>& locked : {std::vector<uint16_t>{}, {2}}) {
        const Result<Volume> cut = cut_labels(map, s, locked, {});
        ASSERT_TRUE(cut) << cut.error().message;
        for (size_t n = 0; n < sample_count(map.grid()); ++n) {
            const glm::uvec3 i = index_of(map.grid().size, n);
            EXPECT_EQ(cut->value(i), i.z == 8 && i.x >= 4 ? 0.0f : map.value(i));
        }
    }
}

// A million corners whose edges all cross the whole outline: a saw from bottom to top.
TEST(Scissors, AnOutlineOfManyLongEdgesIsCutAndCanBeStopped) {
    const Volume map = make_volume(make_grid({4, 4, 1}, glm::dvec3(1.0)), ScalarType::u8,
                                   [](glm::uvec3) { return 1.0; });
    Scissors s;
    for (int i = 0; i < 1000000; ++i)
        s.outline_mm.emplace_back(1.6 + 1e-7 * i, i % 2 == 0 ? -5.0 : 9.0, 0.0);
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(cut_labels(map, s, {}, {stop.get_token(), {}}));
    const Result<Volume> cut = cut_labels(map, s, {}, {});
    ASSERT_TRUE(cut) << cut.error().message;
    // The saw and its closing edge lie between x of 1.6 and 1.7: no sample is within.
    EXPECT_EQ(samples_of(*cut), samples_of(map));
}

TEST(Scissors, AreTheSameForAnyNumberOfThreads) {
    std::mt19937 random(8);
    const Grid grid{{70, 66, 40}, cut_grids()[1].world_from_index};
    const Volume map = random_labels(grid, 3, 0.9, 4);
    CutCase c = random_case(grid, true, random);
    c.scissors.seen_first = true;
    c.scissors.action = ScissorsAction::erase_outside;
    std::optional<std::vector<float>> first;
    for (const size_t threads : {1, 2, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const std::vector<float> got = samples_of(*cut_labels(map, c.scissors, {}, {}));
        EXPECT_EQ(got, first.value_or(got)) << threads;
        first = got;
    }
    EXPECT_NE(*first, samples_of(map));
}

TEST(Scissors, BricksThatStayAreShared) {
    const Grid grid = make_grid({96, 32, 32}, glm::dvec3(1.0));
    const Volume map = random_labels(grid, 3, 0.9, 4);
    const Scissors s{.outline_mm = {{2, 2, 0}, {20, 2, 0}, {20, 20, 0}}};
    const Result<Volume> made = cut_labels(map, s, {}, {});
    EXPECT_NE(made->brick_ptr({0, 0, 0}), map.brick_ptr({0, 0, 0}));
    EXPECT_EQ(made->brick_ptr({1, 0, 0}), map.brick_ptr({1, 0, 0}));
    EXPECT_EQ(made->brick_ptr({2, 0, 0}), map.brick_ptr({2, 0, 0}));
}

TEST(Scissors, AFillWithALabelThatTheTypeDoesNotHoldWidensIt) {
    const Grid grid = make_grid({8, 8, 2}, glm::dvec3(1.0));
    const Volume map = random_labels(grid, 2, 0.5, 4);
    const Scissors s{.action = ScissorsAction::fill_inside,
                     .outline_mm = {{-9, -9, 0}, {20, -9, 0}, {20, 20, 0}, {-9, 20, 0}},
                     .label = 700};
    const Result<Volume> made = cut_labels(map, s, {}, {});
    EXPECT_EQ(made->type(), ScalarType::u16);
    for (size_t n = 0; n < sample_count(grid); ++n) {
        const glm::uvec3 i = index_of(grid.size, n);
        EXPECT_EQ(made->value(i), map.value(i) == 0.0f ? 700.0f : 1.0f);
    }
}

TEST(Scissors, RefuseWhatHasNoMeaning) {
    const Volume map = random_labels(make_grid({8, 8, 2}, glm::dvec3(1.0)), 3, 0.5, 4);
    const Scissors good{.outline_mm = {{0, 0, 0}, {5, 0, 0}, {5, 5, 0}}};
    ASSERT_TRUE(cut_labels(map, good, {}, {}));
    const auto refused = [&](const auto& change) {
        Scissors s = good;
        change(s);
        const std::array locked{uint16_t{2}};
        return !cut_labels(map, s, locked, {});
    };
    EXPECT_TRUE(refused([](Scissors& s) { s.outline_mm.pop_back(); }));
    EXPECT_TRUE(refused([](Scissors& s) { s.towards = glm::dvec3(0.0); }));
    EXPECT_TRUE(refused([](Scissors& s) { s.label = 0; }));
    EXPECT_TRUE(refused([](Scissors& s) { s.label = 2; }));
    EXPECT_TRUE(refused([](Scissors& s) { s.eye_mm = glm::dvec3(0.0, 0.0, 1.0); }));
    EXPECT_TRUE(refused([](Scissors& s) { s.depths_mm = {2.0, 1.0}; }));
    EXPECT_TRUE(refused([](Scissors& s) {
        s.action = ScissorsAction::fill_inside;
        s.seen_first = true;
    }));
    EXPECT_FALSE(refused([](Scissors& s) {
        s.all_labels = true;
        s.label = 2;
    })) << "a cut through all labels names none";
}

TEST(Scissors, AreReadFromText) {
    const std::string text =
        R"({"scissors": 1, "units": "mm", "action": "erase-outside", "label": 7,
            "outline_mm": [[1, 2, 3], [4, 5, 6], [7, 8, 10]], "towards": [0, 0, -1],
            "eye_mm": [0, 0, 99], "depths_mm": [-2, 3.5], "seen_first": true})";
    const Result<Scissors> read = parse_scissors(text, "cut.json");
    ASSERT_TRUE(read) << read.error().message;
    const Scissors expected{.action = ScissorsAction::erase_outside,
                            .outline_mm = {{1, 2, 3}, {4, 5, 6}, {7, 8, 10}},
                            .towards = {0, 0, -1},
                            .eye_mm = glm::dvec3(0, 0, 99),
                            .label = 7,
                            .depths_mm = {{-2.0, 3.5}},
                            .seen_first = true};
    EXPECT_EQ(*read, expected);
    for (const auto& [from, to] : {std::pair("\"mm\"", "\"cm\""),
                                   {"erase-outside", "erase"},
                                   {"[7, 8, 10]", "[7, 8]"},
                                   {"-2, 3.5", "1"},
                                   {"eye_mm", "eye"}}) {
        std::string bad = text;
        bad.replace(bad.find(from), std::string(from).size(), to);
        const Result<Scissors> made = parse_scissors(bad, "cut.json");
        ASSERT_FALSE(made) << to;
        EXPECT_TRUE(made.error().message.starts_with("cut.json:")) << made.error().message;
    }
}

} // namespace
} // namespace palpate
