// ITK's filters, as a user of ITK would call them.

#include <algorithm>

#include <itkBSplineInterpolateImageFunction.h>
#include <itkBilateralImageFilter.h>
#include <itkBinaryCrossStructuringElement.h>
#include <itkBinaryErodeImageFilter.h>
#include <itkConnectedComponentImageFilter.h>
#include <itkFastMarchingImageFilter.h>
#include <itkFlatStructuringElement.h>
#include <itkGradientMagnitudeRecursiveGaussianImageFilter.h>
#include <itkGradientVectorFlowImageFilter.h>
#include <itkIdentityTransform.h>
#include <itkLinearInterpolateImageFunction.h>
#include <itkMedianImageFilter.h>
#include <itkResampleImageFilter.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>
#include <itkSmoothingRecursiveGaussianImageFilter.h>
#include <itkThresholdSegmentationLevelSetImageFilter.h>

#include "bench/segment/cases.h"
#include "engine/volume/box.h"
#include "engine/volume/builder.h"

namespace palpate::bench {

namespace {

using Grey = itk::Image<float, 3>;
using Mask = itk::Image<unsigned char, 3>;

template <class Image>
typename Image::Pointer image_of(const Volume& volume) {
    auto image = Image::New();
    const glm::uvec3 n = volume.size();
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    image->SetRegions(typename Image::RegionType(typename Image::SizeType{{n.x, n.y, n.z}}));
    image->SetSpacing(&spacing[0]);
    image->SetOrigin(&volume.grid().world_from_index[3][0]);
    image->Allocate();
    read_box(volume, glm::ivec3(0), glm::ivec3(n), packed(n), image->GetBufferPointer());
    return image;
}

// A filter anew for each run: an ITK filter that is up to date does nothing.
template <class Filter, class Image>
ItkRun runs_of(typename Image::Pointer input, const std::function<void(Filter&)>& set) {
    auto out = std::make_shared<typename Filter::OutputImageType::Pointer>();
    return {[=] {
                auto filter = Filter::New();
                filter->SetInput(input);
                set(*filter);
                filter->Update();
                *out = filter->GetOutput();
                (*out)->DisconnectPipeline();
            },
            [=] {
                const auto* from = (*out)->GetBufferPointer();
                const size_t count = (*out)->GetLargestPossibleRegion().GetNumberOfPixels();
                return Samples(from, from + count);
            }};
}

template <class Kernel>
ItkRun erosion_run(const SegmentInput& input, const Kernel& kernel) {
    using Erode = itk::BinaryErodeImageFilter<Mask, Mask, Kernel>;
    return runs_of<Erode, Mask>(image_of<Mask>(input.bone), [=](Erode& f) {
        f.SetKernel(kernel);
        f.SetForegroundValue(1);
        f.SetBoundaryToForeground(true);
    });
}

ItkRun erosion_by_cross_run(const SegmentInput& input) {
    itk::BinaryCrossStructuringElement<unsigned char, 3> cross;
    cross.SetRadius(1);
    cross.CreateStructuringElement();
    return erosion_run(input, cross);
}

// The samples whose centres lie within the ball, in mm.
ItkRun erosion_by_ball_run(const SegmentInput& input) {
    using Element = itk::FlatStructuringElement<3>;
    const glm::dvec3 spacing = spacing_mm(input.bone.grid());
    Element element;
    Element::RadiusType radius;
    for (unsigned a = 0; a < 3; ++a)
        radius[a] = size_t(kBall_mm * (1 + 1e-9) / spacing[int(a)]);
    element.SetRadius(radius);
    for (unsigned i = 0; i < element.Size(); ++i) {
        const auto offset = element.GetOffset(i);
        const glm::dvec3 d = spacing * glm::dvec3(offset[0], offset[1], offset[2]);
        element[i] = glm::length(d) <= kBall_mm * (1 + 1e-9);
    }
    return erosion_run(input, element);
}

ItkRun resample_run(const SegmentInput& input, bool cubic) {
    using Resample = itk::ResampleImageFilter<Grey, Grey>;
    // Ours knows places in the world; ITK's image lies along the axes of the samples.
    const Grid straight = make_grid(input.grey.size(), spacing_mm(input.grey.grid()));
    const Grid grid = turned_grid(straight);
    const Grey::Pointer image = image_of<Grey>(with_grid(input.grey, straight));
    return runs_of<Resample, Grey>(image, [=](Resample& f) {
        f.SetTransform(itk::IdentityTransform<double, 3>::New());
        if (cubic) {
            auto spline = itk::BSplineInterpolateImageFunction<Grey, double, double>::New();
            spline->SetSplineOrder(3);
            f.SetInterpolator(spline);
        } else {
            f.SetInterpolator(itk::LinearInterpolateImageFunction<Grey, double>::New());
        }
        Grey::DirectionType direction;
        const glm::dvec3 spacing = spacing_mm(grid);
        for (unsigned a = 0; a < 3; ++a)
            for (unsigned r = 0; r < 3; ++r)
                direction(r, a) = grid.world_from_index[int(a)][int(r)] / spacing[int(a)];
        f.SetSize({{grid.size.x, grid.size.y, grid.size.z}});
        f.SetOutputSpacing(&spacing[0]);
        f.SetOutputOrigin(&grid.world_from_index[3][0]);
        f.SetOutputDirection(direction);
    });
}

// Runs on the gradient of the edge map by differences of neighbours, as ours takes it, with half of
// the largest time step at which the iteration is stable. ITK reads no spacing here: it is 1.
ItkRun vector_flow_run(const SegmentInput& input) {
    using Vector = itk::CovariantVector<float, 3>;
    using Vectors = itk::Image<Vector, 3>;
    using Flow = itk::GradientVectorFlowImageFilter<Vectors, Vectors>;
    auto gradient = Vectors::New();
    const Grey::Pointer edges = image_of<Grey>(input.edges);
    gradient->SetRegions(edges->GetLargestPossibleRegion());
    gradient->Allocate();
    const glm::ivec3 n(input.edges.size());
    const auto value = [&](glm::ivec3 i) {
        i = glm::clamp(i, glm::ivec3(0), n - 1);
        return edges->GetPixel({{i.x, i.y, i.z}});
    };
    for (glm::ivec3 i(0); i.z < n.z; ++i.z)
        for (i.y = 0; i.y < n.y; ++i.y)
            for (i.x = 0; i.x < n.x; ++i.x) {
                Vector g;
                for (int a = 0; a < 3; ++a) {
                    glm::ivec3 d(0);
                    d[a] = 1;
                    g[unsigned(a)] = 0.5f * (value(i + d) - value(i - d));
                }
                gradient->SetPixel({{i.x, i.y, i.z}}, g);
            }
    auto out = std::make_shared<Vectors::Pointer>();
    return {[=] {
                auto filter = Flow::New();
                filter->SetInput(gradient);
                filter->SetLaplacianFilter(Flow::LaplacianFilterType::New());
                filter->SetIterationNum(10);
                filter->SetNoiseLevel(kFlowMu);
                filter->SetTimeStep(0.5 * 2.0 / (12.0 * kFlowMu + 1.0));
                filter->Update();
                *out = filter->GetOutput();
                (*out)->DisconnectPipeline();
            },
            [=] {
                const Vector* from = (*out)->GetBufferPointer();
                Samples x((*out)->GetLargestPossibleRegion().GetNumberOfPixels());
                for (size_t i = 0; i < x.size(); ++i)
                    x[i] = from[i][0];
                return x;
            }};
}

ItkRun fast_marching_run(const SegmentInput& input, const Volume& cost) {
    using March = itk::FastMarchingImageFilter<Grey, Grey>;
    const Grey::Pointer speed = image_of<Grey>(cost);
    const size_t count = speed->GetLargestPossibleRegion().GetNumberOfPixels();
    for (size_t i = 0; i < count; ++i) // walls are slow
        speed->GetBufferPointer()[i] = 1.0f / std::min(speed->GetBufferPointer()[i], 1e6f);
    const glm::uvec3 middle = input.grey.size() / 2u;
    return runs_of<March, Grey>(speed, [=](March& march) {
        auto trials = March::NodeContainer::New();
        March::NodeType node;
        node.SetIndex({{middle.x, middle.y, middle.z}});
        node.SetValue(0.0f);
        trials->InsertElement(0, node);
        march.SetTrialPoints(trials);
    });
}

// The same speed, of grey values in parts of the interval's half; beyond twice that ITK's falls on,
// and its time step with it.
ItkRun level_set_run(const SegmentInput& input) {
    using LevelSet = itk::ThresholdSegmentationLevelSetImageFilter<Grey, Grey>;
    const Grey::Pointer start = image_of<Grey>(input.tissues);
    const Grey::Pointer feature = image_of<Grey>(input.grey);
    const size_t count = start->GetLargestPossibleRegion().GetNumberOfPixels();
    for (size_t i = 0; i < count; ++i) {
        float &inside = start->GetBufferPointer()[i], &value = feature->GetBufferPointer()[i];
        inside = inside > 0.0f ? -0.5f : 0.5f;
        value = std::clamp(value / 300.0f, -2.0f, 2.0f);
    }
    return runs_of<LevelSet, Grey>(start, [=](LevelSet& f) {
        f.SetFeatureImage(feature);
        f.SetLowerThreshold(-1.0f);
        f.SetUpperThreshold(1.0f);
        f.SetPropagationScaling(1.0f);
        f.SetCurvatureScaling(float(kSkinCurvature_mm));
        f.SetIsoSurfaceValue(0.0f);
        f.SetMaximumRMSError(0.0);
        f.SetNumberOfIterations(kSkinSteps);
        f.UseImageSpacingOn();
    });
}

} // namespace

std::optional<ItkRun> itk_filter(const std::string& name, const SegmentInput& input) {
    if (name == "recursive-gaussian")
        return runs_of<itk::SmoothingRecursiveGaussianImageFilter<Grey, Grey>, Grey>(
            image_of<Grey>(input.grey), [](auto& f) { f.SetSigma(1.5); });
    if (name == "gradient-magnitude")
        return runs_of<itk::GradientMagnitudeRecursiveGaussianImageFilter<Grey, Grey>, Grey>(
            image_of<Grey>(input.grey), [](auto& f) { f.SetSigma(1.5); });
    if (name == "median")
        return runs_of<itk::MedianImageFilter<Grey, Grey>, Grey>(image_of<Grey>(input.grey),
                                                                 [](auto& f) { f.SetRadius(1); });
    if (name == "bilateral")
        return runs_of<itk::BilateralImageFilter<Grey, Grey>, Grey>(image_of<Grey>(input.grey),
                                                                    [](auto& f) {
                                                                        f.SetDomainSigma(2.0);
                                                                        f.SetRangeSigma(50.0);
                                                                    });
    if (name == "maurer")
        return runs_of<itk::SignedMaurerDistanceMapImageFilter<Mask, Grey>, Mask>(
            image_of<Mask>(input.bone), [](auto& f) {
                f.SetUseImageSpacing(true);
                f.SetSquaredDistance(false);
            });
    if (name == "fast-marching")
        return fast_marching_run(input, soft_tissue_cost(input.grey, {}).value());
    if (name == "fast-marching-alone")
        return fast_marching_run(input, input.one);
    if (name == "level-set")
        return level_set_run(input);
    if (name == "erode-cross")
        return erosion_by_cross_run(input);
    if (name == "erode-ball")
        return erosion_by_ball_run(input);
    if (name == "components")
        return runs_of<itk::ConnectedComponentImageFilter<Mask, itk::Image<unsigned, 3>>, Mask>(
            image_of<Mask>(input.bone), [](auto&) {});
    if (name == "resample-linear" || name == "resample-cubic")
        return resample_run(input, name == "resample-cubic");
    if (name == "vector-flow")
        return vector_flow_run(input);
    return std::nullopt;
}

} // namespace palpate::bench
