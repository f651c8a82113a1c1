#include <itkBSplineInterpolateImageFunction.h>
#include <itkIdentityTransform.h>
#include <itkLinearInterpolateImageFunction.h>
#include <itkNearestNeighborInterpolateImageFunction.h>
#include <itkResampleImageFilter.h>

#include <cmath>

#include "engine/segment/resample.h"
#include "tests/unit/filter_shared/head.h"

namespace palpate {
namespace {

using Interpolate = itk::InterpolateImageFunction<Grey, double>;

// A grid turned about two axes, in the middle of the head, so small that it lies 16 samples or more
// inside, where no border is seen.
Grid turned_inside(const Grid& head) {
    const double c = std::cos(0.4), s = std::sin(0.4);
    const glm::dmat3 axes =
        glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1) * glm::dmat3(1, 0, 0, 0, c, s, 0, -s, c);
    Grid grid = make_grid({90, 80, 40}, {1, 1, 1});
    const glm::dvec3 spacing(0.83, 1.21, 0.77);
    for (int a = 0; a < 3; ++a)
        grid.world_from_index[a] = glm::dvec4(axes[a] * spacing[a], 0.0);
    const glm::dvec3 middle = center_mm(head) - center_mm(grid);
    grid.world_from_index[3] = glm::dvec4(middle + glm::dvec3(0.123, 0.045, 0.067), 1.0);
    return grid;
}

Grey::Pointer resampled_by_itk(Grey::Pointer image, const Grid& grid, Interpolate::Pointer how) {
    auto filter = itk::ResampleImageFilter<Grey, Grey>::New();
    filter->SetInput(image);
    filter->SetTransform(itk::IdentityTransform<double, 3>::New());
    filter->SetInterpolator(how);
    const glm::dvec3 spacing = spacing_mm(grid);
    Grey::DirectionType direction;
    Grey::PointType origin;
    Grey::SizeType size;
    Grey::SpacingType steps;
    for (int a = 0; a < 3; ++a) {
        const auto n = unsigned(a);
        size[n] = grid.size[a];
        steps[n] = spacing[a];
        origin[n] = grid.world_from_index[3][a];
        for (int r = 0; r < 3; ++r)
            direction(unsigned(r), n) = grid.world_from_index[a][r] / spacing[a];
    }
    filter->SetSize(size);
    filter->SetOutputSpacing(steps);
    filter->SetOutputOrigin(origin);
    filter->SetOutputDirection(direction);
    filter->Update();
    return filter->GetOutput();
}

class ResampleBesideItk : public HeadBesideItk {
 protected:
    double most_off(ResampledBy how, Interpolate::Pointer theirs) {
        const Grid grid = turned_inside(head().grid());
        for (int c = 0; c < 8; ++c) { // no sample within 16 of the border
            const glm::dvec3 corner =
                glm::dvec3(grid.size - 1u) * glm::dvec3(c & 1, c >> 1 & 1, c >> 2);
            const glm::dvec3 at = index_point(head().grid(), world_point(grid, corner));
            EXPECT_TRUE(glm::all(glm::greaterThan(at, glm::dvec3(16))) &&
                        glm::all(glm::lessThan(at, glm::dvec3(head().size()) - 17.0)));
        }
        const Volume ours = resample(head(), {grid, how, 0}, {}).value();
        const std::vector<float> found = samples_as<float>(ours);
        const Grey::Pointer made = resampled_by_itk(image_, grid, theirs);
        double most = 0;
        for (size_t i = 0; i < found.size(); ++i)
            most = std::max(most, std::abs(double{found[i]} - double{made->GetBufferPointer()[i]}));
        return most;
    }
};

// The axes are turned, so that no place is half-way between samples.
TEST_F(ResampleBesideItk, NearestIsTheSame) {
    EXPECT_EQ(most_off(ResampledBy::nearest,
                       itk::NearestNeighborInterpolateImageFunction<Grey, double>::New()),
              0.0);
}

// Both sum in double and round once; places differ by some 1e-12 samples.
TEST_F(ResampleBesideItk, LinearIsTheSameToARounding) {
    EXPECT_LE(
        most_off(ResampledBy::linear, itk::LinearInterpolateImageFunction<Grey, double>::New()),
        2 * 0x1p-24 * largest() + 1e-9 * span());
}

// Coefficients: ours are floats, cut at 12 samples (1.4e-7 of a value, resample.h); three passes of
// 25 terms whose weights sum up to 3 in size, so that a pass's error of 25 roundings grows by 3 in
// each that follows. ITK's are doubles. Weights of the spline sum up to 1.
TEST_F(ResampleBesideItk, CubicIsTheSameButForTheCut) {
    auto spline = itk::BSplineInterpolateImageFunction<Grey, double, double>::New();
    spline->SetSplineOrder(3);
    const double a_pass = 1.4e-7 + 25 * 0x1p-24;
    EXPECT_LE(most_off(ResampledBy::cubic, spline), (3 + 9 + 27) * a_pass * largest());
}

} // namespace
} // namespace palpate
