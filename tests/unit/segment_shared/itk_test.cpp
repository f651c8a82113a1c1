// Methods beside ITK's on the head CT, each timed in the same run.

#include <gtest/gtest.h>
#include <itkConnectedThresholdImageFilter.h>
#include <itkFastMarchingImageFilter.h>
#include <itkMorphologicalWatershedFromMarkersImageFilter.h>
#include <itkThresholdSegmentationLevelSetImageFilter.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "engine/io/volume_io.h"
#include "engine/segment/edges.h"
#include "engine/segment/fast_marching.h"
#include "engine/segment/flood.h"
#include "engine/segment/level_set.h"
#include "engine/segment/level_set_speed.h"
#include "engine/segment/march_cost.h"
#include "tests/unit/shape_shared/itk_image.h"

namespace palpate {
namespace {

using Grey = itk::Image<float, 3>;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

void tell(const char* name, double ours, double itk) {
    std::printf("%s: %.2f s, ITK %.2f s, %.1f times\n", name, ours, itk, itk / ours);
}

// BesideItk takes over 5 s of a processor: methods run on a head CT, and once more in ITK.
class BesideItk : public testing::Test {
 protected:
    void SetUp() override {
        if (!std::filesystem::exists(kHeadCt))
            GTEST_SKIP() << kHeadCt << " is not there (invesalius-examples)";
        Result<LoadedVolume> head = load_volume(kHeadCt);
        ASSERT_TRUE(head) << head.error().message;
        // ITK's images lie along the world's axes.
        const Grid grid = make_grid(head->volume.size(), spacing_mm(head->volume.grid()));
        head_ = with_grid(head->volume, grid);
        // One sample of brain in the middle, one of air in a corner.
        const SeedBall balls[] = {{1, world_point(grid, glm::dvec3(grid.size / 2u)), 0.0},
                                  {2, world_point(grid, {2, 2, 2}), 0.0}};
        seeds_ = *seed_map(*head_, balls);
    }
    const Grid& grid() const { return head_->grid(); }

    std::optional<Volume> head_, seeds_;
};

TEST_F(BesideItk, FastMarchingOfFirstOrderHasTheSameArrivals) {
    const Result<Volume> cost = statistics_cost(*head_, {1, 1, 40.0, 40.0}, {2.5, 0.05, 0}, {});
    ASSERT_TRUE(cost);
    const std::vector<float> costs = samples_as<float>(*cost);
    Clock::time_point start = Clock::now();
    const Result<Volume> ours =
        fast_marching(*cost, {.seeds = &*seeds_, .label = 1}, {.order = 1}, {});
    const double ours_s = seconds_since(start);
    ASSERT_TRUE(ours);
    start = Clock::now();
    const Result<Volume> second =
        fast_marching(*cost, {.seeds = &*seeds_, .label = 1}, {.order = 2}, {});
    const double second_s = seconds_since(start);
    ASSERT_TRUE(second);

    using March = itk::FastMarchingImageFilter<Grey, Grey>;
    std::vector<float> speeds(costs.size());
    std::transform(costs.begin(), costs.end(), speeds.begin(), [](float c) { return 1.0f / c; });
    auto march = March::New();
    march->SetInput(itk_image<Grey>(grid(), speeds));
    auto trials = March::NodeContainer::New();
    March::NodeType node;
    node.SetIndex({{grid().size.x / 2, grid().size.y / 2, grid().size.z / 2}});
    node.SetValue(0.0);
    trials->InsertElement(0, node);
    march->SetTrialPoints(trials);
    start = Clock::now();
    march->Update();
    const double itk_s = seconds_since(start);
    tell("fast marching, order 1", ours_s, itk_s);
    tell("fast marching, order 2", second_s, itk_s);

    const float* theirs = march->GetOutput()->GetBufferPointer();
    const std::vector<float> found = samples_as<float>(*ours);
    double worst = 0.0;
    for (size_t i = 0; i < found.size(); ++i)
        worst = std::max(worst, std::abs(double(found[i]) - theirs[i]) / (theirs[i] + 1e-3));
    // A path of about 600 samples, each time rounded to a float in both, and the speed to one.
    EXPECT_LE(worst, 600 * 3 * 0x1p-24);
}

TEST_F(BesideItk, RegionGrowingHasTheSameSamples) {
    const std::vector<float> values = samples_as<float>(*head_);
    const LabelInterval interval[] = {{1, {-50.0, 200.0}}};
    Clock::time_point start = Clock::now();
    const Result<Volume> ours = region_growing(*head_, *seeds_, interval, Neighbors::face_6, {});
    const double ours_s = seconds_since(start);
    ASSERT_TRUE(ours);
    auto filter = itk::ConnectedThresholdImageFilter<Grey, ItkMask>::New();
    filter->SetInput(itk_image<Grey>(grid(), values));
    filter->SetLower(-50.0f);
    filter->SetUpper(200.0f);
    filter->AddSeed({{grid().size.x / 2, grid().size.y / 2, grid().size.z / 2}});
    start = Clock::now();
    filter->Update();
    tell("region growing", ours_s, seconds_since(start));
    const unsigned char* theirs = filter->GetOutput()->GetBufferPointer();
    const std::vector<float> found = samples_as<float>(*ours);
    size_t different = 0, inside = 0;
    for (size_t i = 0; i < found.size(); ++i) {
        different += (found[i] == 1.0f) != (theirs[i] != 0);
        inside += theirs[i] != 0;
    }
    EXPECT_EQ(different, 0u);
    EXPECT_GT(inside, found.size() / 100);
}

TEST_F(BesideItk, WatershedDividesTheHeadAlike) {
    const Result<Volume> edges = edge_strength(*head_, {});
    ASSERT_TRUE(edges);
    Clock::time_point start = Clock::now();
    const Result<Volume> ours = watershed(*edges, *seeds_, Neighbors::face_6, {});
    const double ours_s = seconds_since(start);
    ASSERT_TRUE(ours);
    auto filter = itk::MorphologicalWatershedFromMarkersImageFilter<Grey, ItkMask>::New();
    filter->SetInput1(itk_image<Grey>(grid(), samples_as<float>(*edges)));
    filter->SetInput2(itk_image<ItkMask>(grid(), samples_as<unsigned char>(*seeds_)));
    filter->SetMarkWatershedLine(false);
    start = Clock::now();
    filter->Update();
    tell("watershed", ours_s, seconds_since(start));
    const unsigned char* theirs = filter->GetOutput()->GetBufferPointer();
    const std::vector<float> found = samples_as<float>(*ours);
    size_t different = 0;
    for (size_t i = 0; i < found.size(); ++i)
        different += found[i] != float(theirs[i]);
    // They may differ where both seeds reach a sample over passes of the same height, by who is
    // first; where passes differ, both take the lower one.
    EXPECT_LE(different, found.size() / 100);
    std::printf("watershed: %zu of %zu samples differ\n", different, found.size());
}

// The skin of a part of the head, evened by curvature, from all that is not air. Both move by the
// same equation; ITK's sparse field has layers a step apart, and its time step is its own.
TEST_F(BesideItk, AThresholdLevelSetSettlesAlike) {
    const glm::uvec3 first(64, 20, 0), size(128, 100, 108);
    const Grid part = make_grid(size, spacing_mm(grid()));
    const Volume grey = make_volume(part, ScalarType::f32,
                                    [&](glm::uvec3 i) { return double(head_->value(i + first)); });
    const Volume start = above(grey, -100.0f);
    const Result<Volume> speed = threshold_speed(grey, {-300.0, 300.0}, {});
    ASSERT_TRUE(speed);
    const LevelSetOptions options{.curvature_mm = 0.5, .most_iterations = 100};
    Clock::time_point began = Clock::now();
    const Result<LevelSetResult> ours =
        level_set({.labels = &start}, {.speed = &*speed}, options, {});
    const double ours_s = seconds_since(began);
    ASSERT_TRUE(ours) << ours.error().message;

    using LevelSet = itk::ThresholdSegmentationLevelSetImageFilter<Grey, Grey>;
    std::vector<float> model = samples_as<float>(start), feature = samples_as<float>(grey);
    for (float& v : model)
        v = 0.5f - v;        // negative inside
    for (float& v : feature) // so that its speed, 1 - |feature|, is ours: -1 at least
        v = std::clamp(v / 300.0f, -2.0f, 2.0f);
    auto filter = LevelSet::New();
    filter->SetInput(itk_image<Grey>(part, model));
    filter->SetFeatureImage(itk_image<Grey>(part, feature));
    filter->SetLowerThreshold(-1.0f);
    filter->SetUpperThreshold(1.0f);
    filter->SetPropagationScaling(1.0f);
    filter->SetCurvatureScaling(0.5f);
    filter->SetIsoSurfaceValue(0.0f);
    filter->SetMaximumRMSError(0.0);
    filter->SetNumberOfIterations(100);
    filter->UseImageSpacingOn();
    began = Clock::now();
    filter->Update();
    tell("level set, 100 iterations", ours_s, seconds_since(began));

    const float* theirs = filter->GetOutput()->GetBufferPointer();
    const std::vector<float> found = samples_as<float>(ours->labels);
    size_t different = 0, both = 0, of_ours = 0, of_theirs = 0, surface = 0;
    for (size_t i = 0; i < found.size(); ++i) {
        const bool a = found[i] == 1.0f, b = theirs[i] < 0.0f;
        different += a != b, both += a && b, of_ours += a, of_theirs += b;
        const size_t x = i % size.x; // crossings along x stand for a third of the surface or more
        surface += x + 1 < size.x && found[i] != found[i + 1];
    }
    std::printf("level set: Dice %.4f, %zu samples differ, the surface has more than %zu\n",
                2.0 * double(both) / double(of_ours + of_theirs), different, surface);
    // Half a sample either way.
    EXPECT_LE(different, surface);
    EXPECT_GT(both, found.size() / 10);
}

} // namespace
} // namespace palpate
