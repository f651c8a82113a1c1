#include "engine/segment/morphology.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

constexpr Neighbours kEveryNeighbours[] = {Neighbours::faces, Neighbours::edges,
                                           Neighbours::corners};

bool in_element(Neighbours neighbours, glm::ivec3 d) {
    const int apart = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
    return apart <= (neighbours == Neighbours::faces ? 1 : neighbours == Neighbours::edges ? 2 : 3);
}

// By definition: a minimum or maximum over the element, beyond the volume nothing.
template <class Element>
std::vector<bool> brute_force(const std::vector<bool>& in, glm::uvec3 size, glm::ivec3 reach,
                              bool grow, const Element& element) {
    std::vector<bool> out(in.size());
    const glm::ivec3 end(size);
    for (size_t i = 0; i < in.size(); ++i) {
        const glm::ivec3 at(index_of(size, i));
        bool found = in[i];
        for (int z = -reach.z; z <= reach.z; ++z)
            for (int y = -reach.y; y <= reach.y; ++y)
                for (int x = -reach.x; x <= reach.x; ++x) {
                    const glm::ivec3 p = at + glm::ivec3(x, y, z);
                    if (!element(glm::ivec3(x, y, z)) ||
                        glm::any(glm::lessThan(p, glm::ivec3(0))) ||
                        glm::any(glm::greaterThanEqual(p, end)))
                        continue;
                    const bool other =
                        in[size_t(p.x) +
                           size_t(size.x) * (size_t(p.y) + size_t(size.y) * size_t(p.z))];
                    found = grow ? found || other : found && other;
                }
        out[i] = found;
    }
    return out;
}

std::vector<bool> set_of(const Volume& volume) {
    std::vector<bool> out;
    for (const float v : samples_of(volume))
        out.push_back(v != 0.0f);
    return out;
}

Volume made(const Volume& labels, const MorphologyOptions& options) {
    Result<Volume> result = morphology(labels, options, {});
    EXPECT_TRUE(result) << result.error().message;
    return result.value();
}

const glm::uvec3 kMorphologySizes[] = {
    {130, 9, 7}, {64, 5, 3}, {63, 4, 34}, {1, 40, 5}, {33, 1, 1}};

TEST(Morphology, StepsOfNeighboursAreThoseOfTheirDefinition) {
    uint64_t seed = 1;
    for (const glm::uvec3 size : kMorphologySizes)
        for (const Neighbours neighbours : kEveryNeighbours)
            for (const MorphologyStep step : {MorphologyStep::erode, MorphologyStep::dilate}) {
                const bool grow = step == MorphologyStep::dilate;
                const Volume labels =
                    random_labels(make_grid(size, {1, 1, 1}), 2, grow ? 0.95 : 0.9, seed++);
                const auto element = [&](glm::ivec3 d) { return in_element(neighbours, d); };
                std::vector<bool> expected = set_of(labels);
                for (int i = 0; i < 2; ++i)
                    expected = brute_force(expected, size, glm::ivec3(1), grow, element);
                EXPECT_EQ(
                    set_of(made(labels, {.step = step, .neighbours = neighbours, .times = 2})),
                    expected);
            }
}

TEST(Morphology, BallsAreThoseOfTheirDefinitionOnUnevenSpacing) {
    const glm::dvec3 spacing(0.5, 0.8, 2.0);
    uint64_t seed = 50;
    for (const double radius : {0.5, 1.6, 2.0, 3.1})
        for (const bool grow : {false, true}) {
            const glm::uvec3 size(40, 18, 9);
            const Volume labels =
                random_labels(make_grid(size, spacing), 2, grow ? 0.999 : 0.99, seed++);
            const auto element = [&](glm::ivec3 d) {
                return glm::length(glm::dvec3(d) * spacing) <= radius + 1e-9;
            };
            const std::vector<bool> expected =
                brute_force(set_of(labels), size, {7, 4, 2}, grow, element);
            EXPECT_EQ(
                set_of(made(labels, {.step = grow ? MorphologyStep::dilate : MorphologyStep::erode,
                                     .radius_mm = radius})),
                expected);
        }
}

// Balls of more rows than are joined: a threshold of the distance.
TEST(Morphology, SoAreLargeBalls) {
    const glm::dvec3 spacing(0.5, 0.8, 2.0);
    const glm::uvec3 size(70, 6, 4);
    for (const double radius : {8.0, 15.0}) // 3 * 10 * 4 + 16 and 3 * 18.75 * 7.5 + 30 steps
        for (const bool grow : {false, true}) {
            const Volume labels = // two samples, or all but them
                make_volume(make_grid(size, spacing), ScalarType::u8, [&](glm::uvec3 i) {
                    const bool is_one = i == glm::uvec3(40, 4, 2) || i == glm::uvec3(69, 0, 3);
                    return is_one == grow ? 1.0 : 0.0;
                });
            const auto element = [&](glm::ivec3 d) {
                return glm::length(glm::dvec3(d) * spacing) <= radius + 1e-9;
            };
            const std::vector<bool> expected =
                brute_force(set_of(labels), size, {32, 5, 3}, grow, element); // none is farther
            EXPECT_EQ(
                set_of(made(labels, {.step = grow ? MorphologyStep::dilate : MorphologyStep::erode,
                                     .radius_mm = radius})),
                expected);
        }
}

TEST(Morphology, OpeningAndClosingAreIdempotentAndOrdered) {
    const Volume labels = random_labels(make_grid({70, 30, 12}, {1, 1, 2}), 2, 0.95, 9);
    const std::vector<bool> before = set_of(labels);
    for (const std::optional<double> radius : {std::optional<double>(), std::optional<double>(2.5)})
        for (const MorphologyStep step : {MorphologyStep::open, MorphologyStep::close}) {
            const MorphologyOptions options{
                .step = step, .neighbours = Neighbours::edges, .radius_mm = radius};
            const Volume once = made(labels, options);
            EXPECT_EQ(samples_of(made(once, options)), samples_of(once));
            const std::vector<bool> after = set_of(once);
            for (size_t i = 0; i < after.size(); ++i)
                ASSERT_TRUE(step == MorphologyStep::open ? after[i] <= before[i]
                                                         : after[i] >= before[i]);
        }
}

TEST(Morphology, ErodingTheComplementIsDilating) {
    const Volume labels = random_labels(make_grid({90, 20, 10}, {1, 1, 1}), 2, 0.9, 4);
    const Volume turned = make_volume(labels.grid(), ScalarType::u8, [&](glm::uvec3 i) {
        return labels.value(i) == 0.0f ? 1.0 : 0.0;
    });
    for (const Neighbours neighbours : kEveryNeighbours) {
        std::vector<bool> dilated =
            set_of(made(labels, {.step = MorphologyStep::dilate, .neighbours = neighbours}));
        dilated.flip();
        EXPECT_EQ(set_of(made(turned, {.neighbours = neighbours})), dilated);
    }
}

TEST(Morphology, OneLabelGrowsOverBackgroundAloneUnlessAsked) {
    const Volume labels = random_labels(make_grid({40, 20, 10}, {1, 1, 1}), 4, 0.8, 21);
    const std::vector<float> before = samples_of(labels);
    const Volume mask = make_volume(labels.grid(), ScalarType::u8, [&](glm::uvec3 i) {
        return labels.value(i) == 2.0f ? 1.0 : 0.0;
    });
    const std::vector<bool> grown = set_of(made(mask, {.step = MorphologyStep::dilate}));
    for (const bool overwrite : {false, true}) {
        const std::vector<float> after = samples_of(
            made(labels, {.step = MorphologyStep::dilate, .label = 2, .overwrite = overwrite}));
        for (size_t i = 0; i < after.size(); ++i)
            EXPECT_EQ(after[i], grown[i] && (overwrite || before[i] == 0.0f) ? 2.0f : before[i]);
    }
    const std::vector<bool> kept = set_of(made(mask, {}));
    const std::vector<float> eroded = samples_of(made(labels, {.label = 2}));
    for (size_t i = 0; i < eroded.size(); ++i)
        EXPECT_EQ(eroded[i], before[i] == 2.0f && !kept[i] ? 0.0f : before[i]);
}

TEST(Morphology, OfEmptyAndFullVolumesChangesNothing) {
    for (const double value : {0.0, 1.0})
        for (const std::optional<double> radius :
             {std::optional<double>(), std::optional<double>(4.0)})
            for (const MorphologyStep step :
                 {MorphologyStep::erode, MorphologyStep::dilate, MorphologyStep::close}) {
                const Volume all = make_volume(make_grid({70, 3, 1}, {1, 1, 1}), ScalarType::u8,
                                               [&](glm::uvec3) { return value; });
                EXPECT_EQ(samples_of(made(all, {.step = step, .radius_mm = radius})),
                          samples_of(all));
            }
}

TEST(Morphology, RefusesInOneSentence) {
    const Volume labels = random_labels(make_grid({4, 4, 4}, {1, 1, 1}), 2, 0.5, 1);
    EXPECT_FALSE(morphology(labels, {.radius_mm = 0.0}, {}));
    EXPECT_FALSE(morphology(labels, {.label = uint16_t{0}}, {}));
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(morphology(labels, {}, {stop.get_token(), {}}));
}

} // namespace
} // namespace palpate
