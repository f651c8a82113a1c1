#include <itkBilateralImageFilter.h>
#include <itkHessianToObjectnessMeasureImageFilter.h>
#include <itkMedianImageFilter.h>
#include <itkRecursiveGaussianImageFilter.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/segment/bilateral.h"
#include "engine/segment/derivatives.h"
#include "engine/segment/gaussian.h"
#include "engine/segment/kernel.h"
#include "engine/segment/median.h"
#include "engine/segment/vesselness.h"
#include "tests/unit/filter_shared/head.h"

namespace palpate {
namespace {

constexpr double kSigma_mm = 3.0; // ITK's recursion is meant for two samples or more

using Pass = itk::RecursiveGaussianImageFilter<Grey, Grey>;

Grey::Pointer recursive(Grey::Pointer image, unsigned axis, int order) {
    auto pass = Pass::New();
    pass->SetInput(image);
    pass->SetDirection(axis);
    pass->SetSigma(kSigma_mm);
    pass->SetOrder(order == 0 ? itk::RecursiveGaussianImageFilterEnums::GaussianOrder::ZeroOrder
                   : order == 1
                       ? itk::RecursiveGaussianImageFilterEnums::GaussianOrder::FirstOrder
                       : itk::RecursiveGaussianImageFilterEnums::GaussianOrder::SecondOrder);
    pass->SetNormalizeAcrossScale(false);
    pass->Update();
    // ITK's derivatives are by the sample.
    const double unit = std::pow(image->GetSpacing()[axis], -order);
    const Grey::Pointer made = pass->GetOutput();
    float* values = made->GetBufferPointer();
    const size_t count = made->GetLargestPossibleRegion().GetNumberOfPixels();
    std::transform(values, values + count, values, [=](float v) { return float(unit * v); });
    return made;
}

Grey::Pointer recursive(Grey::Pointer image, glm::ivec3 orders) {
    for (unsigned axis = 0; axis < 3; ++axis)
        image = recursive(image, axis, orders[int(axis)]);
    return image;
}

// Weights of samples -kFar .. kFar of a kernel along an axis, per mm of the order.
constexpr int kFar = 40;
using Weights = std::vector<double>;

Weights weights_of_itk(double spacing_mm, int order) {
    const Grid grid = make_grid({2 * kFar + 1, 8, 8}, {spacing_mm, 1, 1});
    std::vector<float> impulse(sample_count(grid), 0.0f);
    for (size_t row = 0; row < 64; ++row)
        impulse[row * (2 * kFar + 1) + kFar] = 1.0f;
    const Grey::Pointer made = recursive(itk_image<Grey>(grid, impulse), 0, order);
    const float* first = made->GetBufferPointer();
    Weights weights(first, first + 2 * kFar + 1);
    std::reverse(weights.begin(), weights.end()); // the response at n is the weight of -n
    return weights;
}

Weights weights_of_ours(double spacing_mm, int order) {
    const Kernel kernel = gaussian_kernel(kSigma_mm / spacing_mm, order);
    Weights weights(2 * kFar + 1, 0.0);
    const double unit = std::pow(spacing_mm, -order);
    if (order == 0)
        weights[kFar] = 1.0;
    for (int n = 1; n <= kernel.radius(); ++n) {
        const double w = unit * double{kernel.weights[size_t(n)]};
        weights[size_t(kFar + n)] = w;
        weights[size_t(kFar - n)] = order == 1 ? -w : w;
        if (order != 1)
            weights[kFar] -= 2.0 * w;
    }
    return weights;
}

double sum_of_sizes(const Weights& a, const Weights& b = Weights(2 * kFar + 1, 0.0)) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i)
        sum += std::abs(a[i] - b[i]);
    return sum;
}

// The most by which two separable kernels can differ on samples of a span: with the kernels' sums
// of sizes |.|, |a1 a2 a3 - b1 b2 b3| <= |a1 - b1| |a2| |a3| + |b1| |a2 - b2| |a3| + ..; of values
// about their middle, which are half of the span at most (a constant is what both give alike: it
// is seen by the sums of the kernels, which are part of the differences). Both extend the volume by
// its outermost samples.
double bound(glm::dvec3 spacing, glm::ivec3 orders, double half_span, double middle) {
    double total = 0, sums = 0;
    for (int changed = 0; changed < 3; ++changed) {
        double product = 1, sum = 1;
        for (int axis = 0; axis < 3; ++axis) {
            const Weights a = weights_of_itk(spacing[axis], orders[axis]);
            const Weights b = weights_of_ours(spacing[axis], orders[axis]);
            const auto sum_of = [](const Weights& w) {
                double s = 0;
                for (const double one : w)
                    s += one;
                return std::abs(s);
            };
            product *= axis == changed ? sum_of_sizes(a, b) : sum_of_sizes(axis < changed ? b : a);
            Weights off = a;
            for (size_t i = 0; i < off.size(); ++i)
                off[i] -= b[i];
            sum *= axis == changed ? sum_of(off) : sum_of(axis < changed ? b : a);
        }
        total += product;
        sums += sum;
    }
    return total * half_span + sums * std::abs(middle);
}

// SmoothBesideItk takes over 5 s of a processor: each filter runs on a head CT, and once more in
// ITK.
class SmoothBesideItk : public HeadBesideItk {
 protected:
    // The largest difference, over what the kernels and floats allow.
    void expect_near(const Volume& ours, const Grey::Pointer& theirs, glm::ivec3 orders) {
        const glm::dvec3 spacing = spacing_mm(head().grid());
        const double middle = 0.5 * (double{head().range().max} + double{head().range().min});
        double allowed = bound(spacing, orders, 0.5 * span(), middle);
        // Ours: three passes of at most 2 * 11 + 2 roundings. ITK's passes are in double and
        // rounded to float in between.
        double sizes = 1;
        for (int axis = 0; axis < 3; ++axis)
            sizes *= sum_of_sizes(weights_of_ours(spacing[axis], orders[axis]));
        allowed += 3 * 25 * 0x1p-24 * largest() * sizes;
        const std::vector<float> found = samples_as<float>(ours);
        const float* itk = theirs->GetBufferPointer();
        double most = 0, squares = 0, size = 0;
        for (size_t i = 0; i < found.size(); ++i) {
            const double off = double{found[i]} - double{itk[i]};
            most = std::max(most, std::abs(off));
            squares += off * off;
            size += double{itk[i]} * double{itk[i]};
        }
        std::printf("order %d%d%d: %.2g at most, allowed %.2g; rms %.2g of %.2g\n", orders.x,
                    orders.y, orders.z, most, allowed, std::sqrt(squares / double(found.size())),
                    std::sqrt(size / double(found.size())));
        EXPECT_LE(most, allowed);
        EXPECT_LE(allowed, 0.05 * sizes * largest()); // and so it says something
    }
};

TEST_F(SmoothBesideItk, GaussianAndDerivativesDifferByTheirKernelsAlone) {
    expect_near(gaussian(head(), {kSigma_mm}, {}).value(), recursive(image_, {0, 0, 0}), {0, 0, 0});
    for (const int axis : {0, 2}) {
        glm::ivec3 orders(0);
        orders[axis] = 1;
        expect_near(derivative(head(), {kSigma_mm, axis, {}}, {}).value(),
                    recursive(image_, orders), orders);
        orders[axis] = 2;
        expect_near(derivative(head(), {kSigma_mm, axis, axis}, {}).value(),
                    recursive(image_, orders), orders);
    }
    expect_near(derivative(head(), {kSigma_mm, 1, 2}, {}).value(), recursive(image_, {0, 1, 1}),
                {0, 1, 1});
}

// The length of derivatives that are those of ITK, here in double, and in the filter in floats:
// three squares, their sum and a root.
TEST_F(SmoothBesideItk, GradientMagnitudeIsTheLengthOfTheDerivatives) {
    const std::vector<float> length =
        samples_as<float>(gradient_magnitude(head(), {kSigma_mm}, {}).value());
    std::vector<double> squares(length.size(), 0.0);
    for (const int axis : {0, 1, 2}) {
        const std::vector<float> one =
            samples_as<float>(derivative(head(), {kSigma_mm, axis, {}}, {}).value());
        for (size_t i = 0; i < one.size(); ++i)
            squares[i] += double{one[i]} * double{one[i]};
    }
    double worst = 0;
    for (size_t i = 0; i < length.size(); ++i)
        worst = std::max(worst, std::abs(double{length[i]} - std::sqrt(squares[i])) /
                                    (std::sqrt(squares[i]) + 1e-3));
    EXPECT_LE(worst, 8 * 0x1p-24);
}

TEST_F(SmoothBesideItk, MediansAreTheSame) {
    for (const glm::ivec3 radius : {glm::ivec3(1), {2, 1, 0}}) {
        using Median = itk::MedianImageFilter<Grey, Grey>;
        auto filter = Median::New();
        filter->SetInput(image_);
        Median::RadiusType reach;
        for (unsigned a = 0; a < 3; ++a)
            reach[a] = size_t(radius[int(a)]);
        filter->SetRadius(reach);
        filter->Update();
        const std::vector<float> found = samples_as<float>(median(head(), {radius}, {}).value());
        EXPECT_TRUE(
            std::equal(found.begin(), found.end(), filter->GetOutput()->GetBufferPointer()));
    }
}

// Beside a volume of a part of the head: ITK's sum is over a box instead of a ball, its weights of
// values come from a table that is read at the value below, and end at 4 ranges. What lies outside
// our ball is summed up here, sample by sample, in double.
TEST_F(SmoothBesideItk, BilateralDiffersByTheEndOfItsSumsAlone) {
    const glm::ivec3 size(50, 40, 30), first(90, 60, 30);
    const Grid grid = make_grid(glm::uvec3(size), spacing_mm(head().grid()));
    const Volume part = make_volume(grid, ScalarType::i16, [&](glm::uvec3 i) {
        return double{head().value(glm::uvec3(first) + i)};
    });
    constexpr double kRange = 50.0, kSigma = 1.2;
    constexpr unsigned kTable = 100000;
    using Bilateral = itk::BilateralImageFilter<Grey, Grey>;
    auto filter = Bilateral::New();
    filter->SetInput(itk_image<Grey>(grid, samples_as<float>(part)));
    filter->SetDomainSigma(kSigma);
    filter->SetDomainMu(3.0);
    filter->SetRangeSigma(kRange);
    filter->SetNumberOfRangeGaussianSamples(kTable);
    filter->Update();
    const Volume ours = bilateral(part, {kSigma, kRange, false}, {}).value();
    const glm::dvec3 spacing = spacing_mm(grid);
    const glm::ivec3 reach(glm::ceil(3.0 * kSigma / spacing));
    double largest_bound = 0;
    for (glm::ivec3 at(3); at.z < size.z; at.z += 7)
        for (at.y = 3; at.y < size.y; at.y += 7)
            for (at.x = 3; at.x < size.x; at.x += 7) {
                const double centre = part.value(glm::uvec3(at));
                const double found = ours.value(glm::uvec3(at));
                double total = 0, beyond = 0, low = centre, high = centre;
                for (glm::ivec3 d = -reach; d.z <= reach.z; ++d.z)
                    for (d.y = -reach.y; d.y <= reach.y; ++d.y)
                        for (d.x = -reach.x; d.x <= reach.x; ++d.x) {
                            const glm::ivec3 q = glm::clamp(at + d, glm::ivec3(0), size - 1);
                            const double v = part.value(glm::uvec3(q)), off = v - centre;
                            const double mm = glm::length(glm::dvec3(d) * spacing);
                            const double w = std::exp(-0.5 * (mm * mm / (kSigma * kSigma) +
                                                              off * off / (kRange * kRange)));
                            const bool near = std::abs(off) < 4.0 * kRange;
                            const bool in_ball = mm <= 3.0 * kSigma + 1e-9;
                            total += near ? w : 0.0;
                            if (in_ball)
                                low = std::min(low, v), high = std::max(high, v);
                            if (in_ball != near || !in_ball) // of one of the sums alone
                                beyond += w * std::abs(v - found);
                        }
                // A weight of the table is that of a value up to 4 kRange / kTable less: of it
                // 4 * 4 / kTable at most. Ours: 1e-5 of the span (bilateral.h).
                const double allowed = beyond / total + (16.0 / kTable + 1e-5) * (high - low) +
                                       8 * 0x1p-24 * std::abs(centre);
                largest_bound = std::max(largest_bound, beyond / total);
                const float itk = filter->GetOutput()->GetPixel({{at.x, at.y, at.z}});
                ASSERT_LE(std::abs(found - double{itk}), allowed)
                    << at.x << ", " << at.y << ", " << at.z;
            }
    EXPECT_LE(largest_bound, 0.2 * kRange);
}

// ITK's measure of the same matrices, our second derivatives times sigma^2. With |a| <= |b| <= |c|
// ours are off by 1e-7 |c| (vesselness.h). The first factor, of x = b / c, has a slope of at most
// e^-0.5 / alpha = 1.2, so it is off by 2.4e-7. The second, of x = a / sqrt(b c), is off by
// 1.2 * 2e-7 sqrt(c / b), times the first, which is below 2 (b / c)^2: by 5e-7. The third is smooth
// in |H|. The result is rounded to 6e-8.
TEST_F(SmoothBesideItk, VesselnessIsThatOfItsMatrices) {
    using Matrix = itk::SymmetricSecondRankTensor<double, 3>;
    using Matrices = itk::Image<Matrix, 3>;
    constexpr double kStructure = 400.0;
    auto matrices = Matrices::New();
    matrices->SetRegions(image_->GetLargestPossibleRegion());
    matrices->Allocate();
    for (int a = 0; a < 3; ++a)
        for (int b = a; b < 3; ++b) {
            const std::vector<float> one =
                samples_as<float>(derivative(head(), {kSigma_mm, a, b}, {}).value());
            for (size_t i = 0; i < one.size(); ++i)
                matrices->GetBufferPointer()[i](unsigned(a), unsigned(b)) =
                    kSigma_mm * kSigma_mm * double{one[i]};
        }
    using Measure = itk::HessianToObjectnessMeasureImageFilter<Matrices, Grey>;
    auto measure = Measure::New();
    measure->SetInput(matrices);
    measure->SetObjectDimension(1);
    measure->SetScaleObjectnessMeasure(false);
    measure->SetAlpha(0.5);
    measure->SetBeta(0.5);
    measure->SetGamma(kStructure);
    measure->Update();
    const std::vector<float> found = samples_as<float>(
        vesselness(head(), {.from_mm = kSigma_mm, .to_mm = kSigma_mm, .structure = kStructure}, {})
            .value());
    const float* itk = measure->GetOutput()->GetBufferPointer();
    size_t tubes = 0;
    double worst = 0, squares = 0;
    for (size_t i = 0; i < found.size(); ++i) {
        tubes += itk[i] > 0.1f;
        const double off = std::abs(double{found[i]} - double{itk[i]});
        worst = std::max(worst, off);
        squares += off * off;
    }
    std::printf("vesselness: %zu above 0.1; %.2g at most, rms %.2g\n", tubes, worst,
                std::sqrt(squares / double(found.size())));
    EXPECT_GT(tubes, found.size() / 1000);
    EXPECT_LE(worst, 1e-6);
}

} // namespace
} // namespace palpate
