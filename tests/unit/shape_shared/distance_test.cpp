#include <gtest/gtest.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>

#include <chrono>
#include <cmath>

#include "engine/io/volume_io.h"
#include "engine/segment/signed_distance.h"
#include "tests/unit/shape_shared/itk_image.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Outside, ITK's distance is that to the nearest sample of the object, as ours is; of the mask
// turned over, the same holds inside.
TEST(DistanceBesideItk, OfTheBonesOfAHeadIsTheSameOnBothSides) {
    if (!std::filesystem::exists(kHeadCt))
        GTEST_SKIP() << kHeadCt << " is not there (invesalius-examples)";
    const Result<LoadedVolume> head = load_volume(kHeadCt);
    ASSERT_TRUE(head) << head.error().message;
    const Volume bone = above(head->volume, 300.0f);
    Clock::time_point start = Clock::now();
    const Result<Volume> ours = signed_distance(bone, {}, {});
    const double ours_ms = ms_since(start);
    ASSERT_TRUE(ours);
    using Maurer = itk::SignedMaurerDistanceMapImageFilter<ItkMask, itk::Image<float, 3>>;
    double itk_ms = 0.0;
    for (const bool turned : {false, true}) {
        std::vector<unsigned char> mask = samples_as<unsigned char>(bone);
        for (unsigned char& one : mask)
            one = (one != 0) != turned;
        auto filter = Maurer::New();
        filter->SetInput(itk_image<ItkMask>(bone.grid(), mask));
        filter->SetSquaredDistance(false);
        filter->SetUseImageSpacing(true);
        start = Clock::now();
        filter->Update();
        itk_ms = ms_since(start);
        const float* theirs = filter->GetOutput()->GetBufferPointer();
        const std::vector<float> found = samples_as<float>(*ours);
        size_t compared = 0;
        float worst_mm = 0.0f;
        for (size_t i = 0; i < found.size(); ++i) {
            const float mine = turned ? -found[i] : found[i];
            if (mine < 0.0f)
                continue;
            ++compared;
            worst_mm = std::max(worst_mm, std::abs(mine - theirs[i]));
        }
        EXPECT_GT(compared, found.size() / 20);
        // ITK subtracts coordinates in float: up to 256 mm they are rounded by 2^-17 mm, two in
        // each of three axes, and as much again where it takes one sample for nearer than another.
        EXPECT_LE(worst_mm, 12 * 0x1p-17f);
    }
    std::printf("signed distance of %zu samples: %.0f ms, ITK %.0f ms\n",
                size_t(sample_count(bone.grid())), ours_ms, itk_ms);
}

} // namespace
} // namespace palpate
