#include <gtest/gtest.h>
#include <itkBinaryCrossStructuringElement.h>
#include <itkBinaryErodeImageFilter.h>
#include <itkConnectedComponentImageFilter.h>

#include <map>

#include "engine/io/volume_io.h"
#include "engine/segment/components.h"
#include "engine/segment/morphology.h"
#include "tests/unit/shape_shared/itk_image.h"

namespace palpate {
namespace {

class BonesBesideItk : public testing::Test {
 protected:
    void SetUp() override {
        if (!std::filesystem::exists(kHeadCt))
            GTEST_SKIP() << kHeadCt << " is not there (invesalius-examples)";
        const Result<LoadedVolume> head = load_volume(kHeadCt);
        ASSERT_TRUE(head) << head.error().message;
        bones_ = above(head->volume, 300.0f);
        image_ = itk_image<ItkMask>(bones_->grid(), samples_as<unsigned char>(*bones_));
    }
    std::optional<Volume> bones_;
    ItkMask::Pointer image_;
};

TEST_F(BonesBesideItk, AreErodedToTheSameSamples) {
    using Cross = itk::BinaryCrossStructuringElement<unsigned char, 3>;
    Cross cross;
    cross.SetRadius(1);
    cross.CreateStructuringElement();
    auto filter = itk::BinaryErodeImageFilter<ItkMask, ItkMask, Cross>::New();
    filter->SetInput(image_);
    filter->SetKernel(cross);
    filter->SetForegroundValue(1);
    filter->SetBoundaryToForeground(true); // as ours: nothing erodes at the border
    filter->Update();
    const Result<Volume> ours = morphology(*bones_, {}, {});
    ASSERT_TRUE(ours) << ours.error().message;
    const std::vector<unsigned char> found = samples_as<unsigned char>(*ours);
    EXPECT_TRUE(std::equal(found.begin(), found.end(), filter->GetOutput()->GetBufferPointer()));
}

TEST_F(BonesBesideItk, HaveTheSameComponents) {
    using Numbers = itk::Image<unsigned, 3>;
    for (const Neighbours neighbours : {Neighbours::faces, Neighbours::corners}) {
        auto filter = itk::ConnectedComponentImageFilter<ItkMask, Numbers>::New();
        filter->SetInput(image_);
        filter->SetFullyConnected(neighbours == Neighbours::corners);
        filter->Update();
        const Result<Components> ours =
            connected_components(*bones_, {.neighbours = neighbours, .as_mask = true}, {});
        ASSERT_TRUE(ours) << ours.error().message;
        EXPECT_EQ(ours->list.size(), size_t(filter->GetObjectCount()));
        // One number of theirs for each of ours, and the reverse.
        std::map<unsigned, unsigned> theirs_of, ours_of;
        const std::vector<unsigned> found = samples_as<unsigned>(ours->numbers);
        const unsigned* theirs = filter->GetOutput()->GetBufferPointer();
        for (size_t i = 0; i < found.size(); ++i) {
            ASSERT_EQ(theirs_of.try_emplace(found[i], theirs[i]).first->second, theirs[i]);
            ASSERT_EQ(ours_of.try_emplace(theirs[i], found[i]).first->second, found[i]);
        }
    }
}

} // namespace
} // namespace palpate
