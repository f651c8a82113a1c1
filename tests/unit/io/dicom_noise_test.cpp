// Series whose images state orientation, spacing and position with noise, and images among them
// that belong elsewhere. The truth is known: a stack is made of it, then disturbed and shuffled.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/decode/dicom_fit.h"

namespace palpate::io {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Random {
 public:
    explicit Random(uint64_t seed) : engine_(seed) {}
    double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    double within(double low, double high) { return low + (high - low) * unit(); }
    int below(int end) { return static_cast<int>(engine_() % static_cast<uint64_t>(end)); }
    glm::dvec3 cube(double half) {
        return {within(-half, half), within(-half, half), within(-half, half)};
    }
    template <class T>
    void shuffle(std::vector<T>& all) {
        for (size_t i = all.size(); i > 1; --i)
            std::swap(all[i - 1], all[static_cast<size_t>(below(static_cast<int>(i)))]);
    }

 private:
    std::mt19937_64 engine_;
};

double rounded(double value, int decimals) {
    const double unit = std::pow(10.0, decimals);
    return std::round(value * unit) / unit;
}

// A right-handed set of axes anywhere.
glm::dmat3 any_axes(Random& random) {
    const glm::dvec3 x = glm::normalize(random.cube(1.0) + glm::dvec3(1e-9));
    const glm::dvec3 y =
        glm::normalize(glm::cross(x, glm::normalize(random.cube(1.0) + glm::dvec3(0, 1e-9, 0))));
    return {x, y, glm::cross(x, y)};
}

// A turn by an angle about an axis (Rodrigues).
glm::dvec3 turned(glm::dvec3 v, glm::dvec3 axis, double degrees) {
    const double angle = degrees * std::acos(-1.0) / 180;
    return v * std::cos(angle) + glm::cross(axis, v) * std::sin(angle) +
           axis * glm::dot(axis, v) * (1 - std::cos(angle));
}

struct Truth {
    glm::dmat3 axes{1.0};
    glm::dvec3 first{-120, -130, 40};
    glm::dvec2 spacing{0.9765625, 0.9765625};
    double step = 2;
    int slices = 24;
    glm::uvec2 size{32, 28};

    glm::dvec3 place(double i, double j, double k) const {
        return first + axes * glm::dvec3(i * spacing.x, j * spacing.y, k * step);
    }
    // Images "000.dcm", .. in the order of the stack.
    std::vector<DicomFrame> images() const {
        std::vector<DicomFrame> all;
        for (int k = 0; k < slices; ++k) {
            DicomFrame& image = all.emplace_back();
            image.file = fmt::format("{:03}.dcm", k);
            image.instance_uid = fmt::format("1.2.{}", k);
            image.series_uid = "1.2";
            image.instance_number = k + 1;
            image.size = size;
            image.position = place(0, 0, k);
            image.axes = glm::dmat2x3{axes[0], axes[1]};
            image.spacing_mm = spacing;
        }
        return all;
    }
};

struct Made {
    Result<DicomStack> stack;
    size_t planes = 0;
};

// As decode_dicom() does: the largest plane is read, the others are left out.
Made noisy_stack_of(std::vector<DicomFrame> images) {
    std::vector<DicomSeries> all = group_series(std::move(images));
    std::vector<DicomFrame> left_out;
    for (size_t i = 1; i < all.size(); ++i)
        left_out.insert(left_out.end(), all[i].frames.begin(), all[i].frames.end());
    return {make_stack({.path = "folder"}, all.front(), 0, left_out), all.size()};
}

// The largest distance of a corner of the volume from its true place.
double farthest_corner(const Grid& grid, const Truth& truth) {
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 at =
            glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * (glm::dvec3(grid.size) - 1.0);
        most = std::max(most, glm::distance(glm::dvec3(grid.world_from_index * glm::dvec4(at, 1)),
                                            truth.place(at.x, at.y, at.z)));
    }
    return most;
}

TEST(DicomNoise, OfDirectionsMakesOneVolume) {
    for (int seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(seed);
        Random random(static_cast<uint64_t>(seed));
        Truth truth;
        if (seed % 4 != 0)
            truth.axes = any_axes(random);
        truth.slices = 2 + random.below(60);
        truth.step = random.within(0.5, 5.0);
        // Alone an image off by as much as the noise elsewhere; at most 1e-3 in each cosine.
        const bool single = seed % 3 == 0;
        const double noise = std::pow(10.0, random.within(-4, -3));
        std::vector<DicomFrame> images = truth.images();
        const size_t odd = static_cast<size_t>(random.below(truth.slices));
        for (size_t k = 0; k < images.size(); ++k)
            if (!single || k == odd) {
                (*images[k].axes)[0] += random.cube(noise);
                (*images[k].axes)[1] += random.cube(noise);
            }
        std::vector<DicomFrame> stated = images;
        random.shuffle(images);
        const Made made = noisy_stack_of(images);
        ASSERT_TRUE(made.stack) << made.stack.error().message;
        const Grid& grid = made.stack->grid;
        EXPECT_EQ(made.planes, 1u);
        ASSERT_EQ(grid.size, glm::uvec3(truth.size, truth.slices));
        for (size_t k = 0; k < stated.size(); ++k)
            EXPECT_EQ(made.stack->frames[k].file, stated[k].file);
        // A mean is no worse than its worst part: an error of sqrt(3) noise in a vector, which
        // being made orthonormal and turned at most doubles.
        const double extent = glm::length(truth.spacing * glm::dvec2(truth.size));
        const double most = 2 * std::sqrt(3.0) * noise * extent * std::sqrt(2.0);
        EXPECT_LT(farthest_corner(grid, truth), most + 1e-9);
        EXPECT_NEAR(glm::length(grid.world_from_index[2]), truth.step, 1e-9);
        const glm::dvec3 x(grid.world_from_index[0]), y(grid.world_from_index[1]);
        EXPECT_NEAR(glm::dot(glm::normalize(x), glm::normalize(y)), 0, 1e-9);
        // The warning says the largest distance between a sample as an image states it and as the
        // grid has it, in two digits.
        double off = 0, degrees = 0;
        for (const DicomFrame& image : stated) {
            const glm::dvec3 own = glm::cross((*image.axes)[0], (*image.axes)[1]);
            degrees = std::max(degrees, glm::length(glm::cross(glm::normalize(own),
                                                               glm::normalize(glm::cross(x, y)))) *
                                            180 / std::acos(-1.0));
            for (const glm::dvec2 corner :
                 {glm::dvec2(31, 0), glm::dvec2(0, 27), glm::dvec2(31, 27)})
                off = std::max(off, glm::distance(*image.axes * (corner * truth.spacing),
                                                  glm::dmat2x3(x, y) * corner));
        }
        const std::vector<std::string>& warnings = made.stack->warnings;
        if (off < 1e-4 * extent / 4) // less is not worth a word
            continue;
        ASSERT_LE(warnings.size(), 1u);
        if (warnings.empty()) {
            EXPECT_LT(off, 2 * std::sqrt(2.0) * 1e-4 * extent);
            continue;
        }
        EXPECT_THAT(warnings[0],
                    AllOf(HasSubstr("direction cosines differ"), HasSubstr("degrees")));
        const size_t at = warnings[0].find("at most ");
        ASSERT_NE(at, std::string::npos) << warnings[0];
        EXPECT_NEAR(std::stod(warnings[0].substr(at + 8)), off, 0.06 * off) << warnings[0];
        // The angle is no less than that of the normals, and no more than noise of two images
        // makes.
        const size_t angle = warnings[0].rfind('(', warnings[0].find(" degrees)"));
        ASSERT_NE(angle, std::string::npos) << warnings[0];
        EXPECT_GE(std::stod(warnings[0].substr(angle + 1)), 0.94 * degrees) << warnings[0];
        EXPECT_LE(std::stod(warnings[0].substr(angle + 1)),
                  1.06 * 6 * noise * 180 / std::acos(-1.0));
    }
}

TEST(DicomNoise, OfPixelSpacingsIsRounding) {
    for (int seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(seed);
        Random random(static_cast<uint64_t>(seed));
        Truth truth;
        truth.spacing = {random.within(0.3, 1.2), random.within(0.3, 1.2)};
        if (seed == 0)
            truth.spacing = glm::dvec2(0.9765625);
        std::vector<DicomFrame> images = truth.images();
        for (DicomFrame& image : images)
            if (seed % 2 == 0 || random.below(4) == 0) // of all, or of a few
                image.spacing_mm =
                    glm::dvec2(rounded(truth.spacing.x, 3), rounded(truth.spacing.y, 3));
        random.shuffle(images);
        const Made made = noisy_stack_of(images);
        ASSERT_TRUE(made.stack) << made.stack.error().message;
        EXPECT_EQ(made.planes, 1u);
        EXPECT_EQ(made.stack->grid.size.z, 24u);
        // Half a unit of the third decimal.
        EXPECT_NEAR(made.stack->grid.world_from_index[0].x, truth.spacing.x, 0.5001e-3);
        EXPECT_NEAR(made.stack->grid.world_from_index[1].y, truth.spacing.y, 0.5001e-3);
        EXPECT_THAT(made.stack->warnings, Each(HasSubstr("pixel spacings differ by up to")));
    }
}

TEST(DicomNoise, OfPositionsIsRounding) {
    for (int seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(seed);
        Random random(static_cast<uint64_t>(seed));
        Truth truth;
        if (seed % 2 != 0)
            truth.axes = any_axes(random);
        const int decimals = seed % 3;
        const double half = 0.5 * std::pow(10.0, -decimals);
        truth.slices = 3 + random.below(60);
        // Rounding moves a place by sqrt(3) halves at most, and half as much again from the fitted
        // line: less than a quarter of the step.
        truth.step = half * random.within(12, 60);
        std::vector<DicomFrame> images = truth.images();
        for (DicomFrame& image : images)
            for (int i = 0; i < 3; ++i)
                (*image.position)[i] = rounded((*image.position)[i], decimals);
        random.shuffle(images);
        const Made made = noisy_stack_of(images);
        ASSERT_TRUE(made.stack) << made.stack.error().message;
        EXPECT_EQ(made.stack->grid.size.z, static_cast<uint32_t>(truth.slices));
        // The end of a fitted line is off by no more than its points: sqrt(3) halves each, and
        // again where the line was fitted to half of them.
        EXPECT_LT(farthest_corner(made.stack->grid, truth), 2 * std::sqrt(3.0) * half + 1e-9);
    }
}

// ---- images that belong elsewhere

TEST(DicomOutliers, InAnotherPlaneAreNamedAndLeaveNoData) {
    for (int seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(seed);
        Random random(static_cast<uint64_t>(seed));
        Truth truth;
        if (seed % 2 != 0)
            truth.axes = any_axes(random);
        std::vector<DicomFrame> images = truth.images();
        if (seed % 5 == 0) // among noise
            for (DicomFrame& image : images) {
                (*image.axes)[0] += random.cube(5e-4);
                (*image.axes)[1] += random.cube(5e-4);
            }
        const auto at = static_cast<size_t>(1 + random.below(truth.slices - 2));
        DicomFrame& odd = images[at];
        std::string words;
        if (const int kind = seed % 4; kind == 0 || kind == 1) {
            const glm::dvec3 axis = glm::normalize(random.cube(1.0) + glm::dvec3(1e-9));
            const double degrees = random.within(1.0, 90.0);
            const glm::dvec3 middle = truth.place(15.5, 13.5, static_cast<double>(at));
            (*odd.axes)[0] = turned((*odd.axes)[0], axis, degrees);
            (*odd.axes)[1] = turned((*odd.axes)[1], axis, degrees);
            if (kind == 1) // about its middle instead of its first sample
                odd.position = middle + turned(*odd.position - middle, axis, degrees);
            words = "another orientation (turned by ";
        } else if (kind == 2) {
            odd.spacing_mm = truth.spacing * random.within(1.01, 2.0);
            words = "another pixel spacing (";
        } else {
            odd.size = {16, 16};
            words = "another size (16 x 16, not 32 x 28)";
        }
        const std::string file = odd.file.string();
        random.shuffle(images);
        const Made made = noisy_stack_of(images);
        ASSERT_TRUE(made.stack) << made.stack.error().message;
        EXPECT_EQ(made.planes, 2u);
        ASSERT_EQ(made.stack->frames.size(), 24u);
        EXPECT_TRUE(made.stack->frames[at].file.empty());
        EXPECT_NEAR(glm::length(made.stack->grid.world_from_index[2]), 2.0, 1e-9);
        EXPECT_THAT(made.stack->warnings,
                    Contains(AllOf(HasSubstr(file + " has " + words), HasSubstr("no data"))));
        EXPECT_THAT(made.stack->warnings, Each(Not(HasSubstr("missing"))));
    }
}

TEST(DicomOutliers, LocalizersChangeNothing) {
    for (int seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        Random random(static_cast<uint64_t>(seed));
        Truth truth;
        const std::vector<DicomFrame> clean = truth.images();
        std::vector<DicomFrame> images = clean;
        for (int i = 0; i < 1 + seed % 5; ++i) {
            DicomFrame scout = clean[0];
            scout.file = fmt::format("scout{}.dcm", i);
            scout.instance_uid = fmt::format("1.3.{}", i);
            scout.axes = glm::dmat2x3{{0, 1, 0}, {0, 0, -1}};
            scout.instance_number = seed % 2 ? 1 + i : 25 + i;
            scout.position = random.cube(200);
            images.push_back(scout);
        }
        random.shuffle(images);
        const Made made = noisy_stack_of(images);
        ASSERT_TRUE(made.stack) << made.stack.error().message;
        EXPECT_EQ(made.stack->grid.world_from_index,
                  noisy_stack_of(clean).stack->grid.world_from_index);
        EXPECT_THAT(made.stack->warnings, IsEmpty());
        // One that is really missing is not taken for one of them.
        images.erase(std::find_if(images.begin(), images.end(),
                                  [](const DicomFrame& image) { return image.file == "012.dcm"; }));
        const Made less = noisy_stack_of(images);
        ASSERT_FALSE(less.stack);
        EXPECT_THAT(less.stack.error().message, HasSubstr("1 slice seems to be missing"));
    }
}

TEST(DicomOutliers, InAnotherPlaceAreNamed) {
    for (int seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(seed);
        Random random(static_cast<uint64_t>(seed));
        Truth truth;
        if (seed % 2 != 0)
            truth.axes = any_axes(random);
        std::vector<DicomFrame> images = truth.images();
        const auto at = static_cast<size_t>(1 + random.below(truth.slices - 2));
        DicomFrame& odd = images[at];
        switch (seed % 3) {
            case 0: // between its place and a neighbour's
                *odd.position += truth.axes[2] * random.within(0.3, 1.7);
                break;
            case 1: // beside the row
                *odd.position += truth.axes[0] * random.within(0.3, 100);
                break;
            default: // far beyond the row
                *odd.position += truth.axes[2] * random.within(60, 900);
        }
        const std::string file = odd.file.string();
        random.shuffle(images);
        const Made made = noisy_stack_of(images);
        ASSERT_FALSE(made.stack);
        EXPECT_THAT(
            made.stack.error().message,
            AllOf(HasSubstr("folder: " + file), HasSubstr(" lies "), Not(HasSubstr("missing"))));
    }
}

TEST(DicomOutliers, MissingSlicesAreMissing) {
    for (int seed = 0; seed < 100; ++seed) {
        SCOPED_TRACE(seed);
        Random random(static_cast<uint64_t>(seed));
        Truth truth;
        if (seed % 2 != 0)
            truth.axes = any_axes(random);
        std::vector<DicomFrame> images = truth.images();
        const double noise = seed % 3 == 0 ? 5e-4 : 0;
        for (DicomFrame& image : images) {
            (*image.axes)[0] += random.cube(noise);
            (*image.axes)[1] += random.cube(noise);
        }
        const int count = 1 + random.below(3);
        const int from = 2 + random.below(truth.slices - 6);
        images.erase(images.begin() + from, images.begin() + from + count);
        if (seed % 4 == 0) // counted anew
            for (size_t k = 0; k < images.size(); ++k)
                images[k].instance_number = static_cast<int64_t>(k);
        random.shuffle(images);
        const Made made = noisy_stack_of(images);
        ASSERT_FALSE(made.stack);
        EXPECT_THAT(made.stack.error().message,
                    HasSubstr(fmt::format("{} slice{} to be missing", count,
                                          count == 1 ? " seems" : "s seem")));
    }
}

} // namespace
} // namespace palpate::io
