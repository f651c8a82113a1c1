// Which images of a 4-D series belong together, and in which order: series made at random from a
// known answer, their files in any order.

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <random>

#include "engine/decode/dicom_stack.h"

namespace palpate::io {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr size_t kPlaces = 5, kFrames = 4;

// The same numbers everywhere, which the distributions of the standard library do not promise.
using Random = std::mt19937;
double below(Random& random, uint32_t end) {
    return random() % end;
}

// States what image (place, frame) says of itself.
using Mark = std::function<void(FrameMarks&, size_t place, size_t frame)>;

// A series in a random order, under random names, with random instance numbers. The truth hides in
// the intercept: the number of the frame.
std::vector<DicomFrame> series(Random& random, const Mark& mark, size_t frames = kFrames) {
    std::vector<DicomFrame> images;
    for (size_t place = 0; place < kPlaces; ++place)
        for (size_t frame = 0; frame < frames; ++frame) {
            DicomFrame& image = images.emplace_back();
            image.size = {4, 3};
            image.position = glm::dvec3(-7, 8, 10 + 3.0 * static_cast<double>(place));
            image.axes = glm::dmat2x3{{1, 0, 0}, {0, 1, 0}};
            image.spacing_mm = glm::dvec2(0.5, 0.75);
            image.rescale.intercept = static_cast<double>(frame);
            image.marks[FrameKey::echo_time_ms] = 5; // what all state alike says nothing
            image.marks[FrameKey::acquisition_number] = 1;
            image.marks.image_type = "ORIGINAL\\PRIMARY";
            mark(image.marks, place, frame);
        }
    for (size_t i = images.size() - 1; i > 0; --i)
        std::swap(images[i], images[random() % (i + 1)]);
    for (size_t i = 0; i < images.size(); ++i) {
        images[i].file = fmt::format("{:03}.dcm", i);
        images[i].instance_uid = fmt::format("1.2.{}", i);
        images[i].instance_number = random() % 7;
    }
    return images;
}

std::string error_of(const std::vector<DicomFrame>& images) {
    const auto stack = make_stack({.path = "folder"}, {"", "", "", images});
    return stack ? "ordered" : stack.error().message;
}

// Every frame must hold its own images, from place to place.
void expect_order(const std::vector<DicomFrame>& images, const std::string& words,
                  size_t frames = kFrames) {
    for (uint32_t t = 0; t < frames; ++t) {
        const auto stack = make_stack({.path = "folder", .frame = t}, {"", "", "", images});
        ASSERT_TRUE(stack) << stack.error().message;
        ASSERT_EQ(stack->frames.size(), kPlaces);
        for (const DicomFrame& image : stack->frames)
            EXPECT_EQ(image.rescale.intercept, t) << image.file;
        EXPECT_THAT(stack->notes, ElementsAre(HasSubstr(words)));
    }
    const auto first = make_stack({.path = "folder"}, {"", "", "", images});
    ASSERT_TRUE(first) << first.error().message;
    EXPECT_THAT(first->warnings, ElementsAre(HasSubstr(fmt::format("{} frames", frames))));
    EXPECT_THAT(first->notes, ElementsAre(HasSubstr(words)));
}

TEST(FrameOrder, IsThatOfTheAttributeThatTellsImagesApart) {
    struct Case {
        FrameKey key;
        const char* name;
    };
    for (const Case& one :
         {Case{FrameKey::temporal_position, "TemporalPositionIdentifier"},
          Case{FrameKey::trigger_time_ms, "TriggerTime"}, Case{FrameKey::echo_time_ms, "EchoTime"},
          Case{FrameKey::b_value, "DiffusionBValue"},
          Case{FrameKey::acquisition_number, "AcquisitionNumber"},
          Case{FrameKey::acquisition_time_s, "AcquisitionTime"},
          Case{FrameKey::echo_number, "EchoNumbers"},
          Case{FrameKey::inversion_time_ms, "InversionTime"},
          Case{FrameKey::flip_angle, "FlipAngle"},
          Case{FrameKey::reference_time_ms, "FrameReferenceTime"}})
        for (uint32_t seed = 0; seed < 4; ++seed) {
            SCOPED_TRACE(fmt::format("{}, seed {}", one.name, seed));
            Random random(seed);
            std::vector<double> values{below(random, 50)};
            while (values.size() < kFrames)
                values.push_back(values.back() + 0.5 + below(random, 9));
            expect_order(series(random, [&](FrameMarks& marks, size_t,
                                            size_t t) { marks[one.key] = values[t]; }),
                         one.name);
        }
}

TEST(FrameOrder, FollowsTimesThatDifferFromPlaceToPlace) {
    for (uint32_t seed = 0; seed < 4; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        // Slices one after another in each volume; a heart that beats now faster, now slower.
        expect_order(series(random,
                            [&](FrameMarks& marks, size_t place, size_t t) {
                                marks[FrameKey::acquisition_time_s] =
                                    static_cast<double>(t) * 2 + static_cast<double>(place) * 0.39;
                            }),
                     "AcquisitionTime");
        std::vector<double> beat(kPlaces);
        for (double& ms : beat)
            ms = 30 + below(random, 20);
        expect_order(series(random,
                            [&](FrameMarks& marks, size_t place, size_t t) {
                                marks[FrameKey::trigger_time_ms] =
                                    beat[place] * static_cast<double>(t);
                            }),
                     "TriggerTime");
        // Numbers that count all images, one place after the other.
        expect_order(series(random,
                            [](FrameMarks& marks, size_t place, size_t t) {
                                marks[FrameKey::acquisition_number] =
                                    static_cast<double>(place * kFrames + t);
                            }),
                     "AcquisitionNumber");
    }
}

TEST(FrameOrder, IsThatOfSeveralAttributesWhereNoneDoesAlone) {
    Random random(1);
    expect_order(series(random,
                        [](FrameMarks& marks, size_t, size_t t) {
                            marks[FrameKey::temporal_position] = static_cast<double>(t / 2);
                            marks[FrameKey::echo_time_ms] = t % 2 == 0 ? 2.3 : 4.6;
                        }),
                 "TemporalPositionIdentifier, then EchoTime");
    expect_order(series(random,
                        [](FrameMarks& marks, size_t place, size_t t) {
                            marks[FrameKey::echo_time_ms] = t < 2 ? 2.3 : 4.6;
                            marks[FrameKey::acquisition_time_s] =
                                static_cast<double>(t % 2 * 60 + place);
                        }),
                 "EchoTime, then AcquisitionTime");
    expect_order(series(random,
                        [](FrameMarks& marks, size_t, size_t t) {
                            marks[FrameKey::b_value] = t < 2 ? 0 : 1000;
                            marks.image_type =
                                t % 2 == 0 ? "ORIGINAL\\PRIMARY\\M" : "ORIGINAL\\PRIMARY\\P";
                        }),
                 "DiffusionBValue, then ImageType");
    expect_order(series(random,
                        [](FrameMarks& marks, size_t place, size_t t) {
                            marks.indices = {{"Stack", 1},
                                             {"Slice", static_cast<uint32_t>(place + 1)},
                                             {"Phase", static_cast<uint32_t>(t + 1)}};
                        }),
                 "Phase (1, 2, 3, 4)");
}

TEST(FrameOrder, HeedsEchoesAndBValuesBesideATime) {
    Random random(1);
    // Directions of one b-value follow in time; the unweighted image comes first everywhere.
    expect_order(series(random,
                        [](FrameMarks& marks, size_t place, size_t t) {
                            marks[FrameKey::b_value] = t == 0 ? 0 : 1000;
                            marks[FrameKey::acquisition_time_s] =
                                static_cast<double>(9 * t + place);
                        }),
                 "AcquisitionTime");
    // The same, but one place was measured the other way round.
    EXPECT_THAT(error_of(series(random,
                                [](FrameMarks& marks, size_t place, size_t t) {
                                    marks[FrameKey::b_value] = t == 0 ? 0 : 1000;
                                    marks[FrameKey::acquisition_time_s] =
                                        static_cast<double>(place == 2 ? 9 - t : t);
                                })),
                AllOf(HasSubstr("DiffusionBValue"), HasSubstr("AcquisitionTime"),
                      HasSubstr("do not go together")));
}

// Positions of one place that differ by noise, within and beyond the rounding of one place.
TEST(FrameOrder, HoldsForPositionsWithNoise) {
    for (const double noise_mm : {0.003, 0.006, 0.02, 0.04})
        for (uint32_t seed = 0; seed < 4; ++seed) {
            SCOPED_TRACE(fmt::format("{} mm, seed {}", noise_mm, seed));
            Random random(seed);
            std::vector<DicomFrame> images =
                series(random, [](FrameMarks& marks, size_t, size_t t) {
                    marks[FrameKey::echo_time_ms] = 2.0 + static_cast<double>(t);
                });
            for (DicomFrame& image : images)
                for (int i = 0; i < 3; ++i)
                    (*image.position)[i] += noise_mm * (2.0 * below(random, 1001) / 1000 - 1);
            for (uint32_t t = 0; t < kFrames; ++t) {
                const auto stack = make_stack({.path = "folder", .frame = t}, {"", "", "", images});
                ASSERT_TRUE(stack) << stack.error().message;
                ASSERT_EQ(stack->frames.size(), kPlaces);
                for (const DicomFrame& image : stack->frames)
                    EXPECT_EQ(image.rescale.intercept, t);
                // A line through points off by noise passes no sample by more than three times it.
                const glm::dmat4& world = stack->grid.world_from_index;
                for (size_t k = 0; k < kPlaces; ++k)
                    EXPECT_LT(glm::distance(glm::dvec3(world * glm::dvec4(0, 0, k, 1)),
                                            glm::dvec3(-7, 8, 10 + 3.0 * static_cast<double>(k))),
                              3 * noise_mm * std::sqrt(3.0));
            }
        }
}

// Thin slices in pairs, as of lungs at high resolution, are slices.
TEST(FrameOrder, PairsOfThinSlicesAreNoFrames) {
    Random random(1);
    std::vector<DicomFrame> images = series(
        random,
        [](FrameMarks& marks, size_t place, size_t t) {
            marks[FrameKey::acquisition_time_s] = static_cast<double>(2 * place + t);
        },
        2);
    for (DicomFrame& image : images)
        image.position->z = 4 * (image.position->z - 10) + 0.5 * image.rescale.intercept;
    EXPECT_THAT(error_of(images), HasSubstr("gap"));
}

TEST(FrameOrder, IsRefusedWhereNothingTellsImagesApart) {
    for (uint32_t seed = 0; seed < 3; ++seed) {
        Random random(seed);
        EXPECT_THAT(error_of(series(random, [](FrameMarks&, size_t, size_t) {})),
                    AllOf(HasSubstr("4 images lie at each of 5 places"), HasSubstr(".dcm"),
                          HasSubstr("EchoTime is 5, 5, 5, 5 ms"),
                          HasSubstr("AcquisitionNumber is 1, 1, 1, 1"),
                          HasSubstr("TriggerTime, DiffusionBValue, AcquisitionTime are not"),
                          HasSubstr("InstanceNumber")));
    }
    // One image without the attribute; a place at which two are equal; values that shift.
    Random random(9);
    EXPECT_THAT(error_of(series(random,
                                [](FrameMarks& marks, size_t place, size_t t) {
                                    if (place != 3 || t != 2)
                                        marks[FrameKey::trigger_time_ms] = static_cast<double>(t);
                                })),
                HasSubstr("TriggerTime is stated by 19 of 20 images"));
    EXPECT_THAT(error_of(series(random,
                                [](FrameMarks& marks, size_t place, size_t t) {
                                    marks[FrameKey::echo_time_ms] =
                                        static_cast<double>(place == 4 && t == 1 ? 0 : t);
                                })),
                HasSubstr("no attribute tells"));
    for (const FrameKey key : {FrameKey::echo_time_ms, FrameKey::temporal_position,
                               FrameKey::b_value, FrameKey::acquisition_number})
        EXPECT_THAT(error_of(series(random,
                                    [&](FrameMarks& marks, size_t place, size_t t) {
                                        marks[key] = static_cast<double>(t + place);
                                    })),
                    HasSubstr("at the last"));
}

TEST(FrameOrder, IsRefusedWhereTwoAttributesDisagree) {
    constexpr FrameKey keys[] = {FrameKey::temporal_position,  FrameKey::trigger_time_ms,
                                 FrameKey::echo_time_ms,       FrameKey::b_value,
                                 FrameKey::acquisition_number, FrameKey::acquisition_time_s};
    Random random(1);
    for (const FrameKey a : keys)
        for (const FrameKey b : keys) {
            if (a == b)
                continue;
            const auto both = [&](bool agree) {
                return series(random, [&](FrameMarks& marks, size_t, size_t t) {
                    marks[a] = static_cast<double>(10 + t);
                    marks[b] = static_cast<double>(agree ? 5 * t : 20 - t);
                });
            };
            EXPECT_THAT(error_of(both(false)), AllOf(HasSubstr("order them differently"),
                                                     HasSubstr(".dcm"), HasSubstr("folder")));
            expect_order(both(true), "are ordered by");
        }
}

TEST(FrameOrder, FramesOfOneFileAtOnePlaceKeepTheirOrder) {
    std::vector<DicomFrame> images;
    for (uint32_t t = 0; t < 6; ++t) {
        DicomFrame& image = images.emplace_back();
        image.file = "cine.dcm";
        image.frame = t;
        image.size = {4, 3};
        image.position = glm::dvec3(0);
    }
    const auto stack = make_stack({.path = "cine.dcm", .frame = 4}, {"", "", "", images});
    ASSERT_TRUE(stack) << stack.error().message;
    ASSERT_EQ(stack->frames.size(), 1u);
    EXPECT_EQ(stack->frames[0].frame, 4u);
    EXPECT_THAT(stack->notes, ElementsAre(HasSubstr("order in the file")));
    for (size_t t = 0; t < images.size(); ++t)
        images[t].file = fmt::format("{}.dcm", t);
    EXPECT_THAT(error_of(images), HasSubstr("no attribute tells"));
}

} // namespace
} // namespace palpate::io
