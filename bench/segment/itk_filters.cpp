// ITK's filters, as a user of ITK would call them.

#include <itkBilateralImageFilter.h>
#include <itkFastMarchingImageFilter.h>
#include <itkGradientMagnitudeRecursiveGaussianImageFilter.h>
#include <itkMedianImageFilter.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>
#include <itkSmoothingRecursiveGaussianImageFilter.h>

#include "bench/segment/cases.h"
#include "engine/volume/box.h"

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

ItkRun fast_marching_run(const SegmentInput& input) {
    using March = itk::FastMarchingImageFilter<Grey, Grey>;
    const Result<Volume> cost = soft_tissue_cost(input.grey, {});
    const Grey::Pointer speed = image_of<Grey>(cost.value());
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
        return fast_marching_run(input);
    return std::nullopt;
}

} // namespace palpate::bench
