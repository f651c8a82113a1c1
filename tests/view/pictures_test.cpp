// Pictures of views: the same bytes whichever way they reach the interface, and in an order in
// which no view waits for long.

#include <algorithm>
#include <atomic>
#include <future>
#include <mutex>
#include <optional>
#include <semaphore>
#include <utility>

#include "apps/view/drawing/pictures.h"
#include "engine/image/display_byte.h"
#include "engine/image/png.h"
#include "engine/volume/extent.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

// PicturesTest takes over 5 s of a processor: whole windows are drawn, and their views once more by
// renderers of their own.
class PicturesTest : public ViewerTest {
 protected:
    PicturesTest()
        : work_(Source{open_synthetic("synthetic:phantom?size=40")}, {800, 600}, 1.0, false) {
        state_ = work_.subject().home;
    }
    std::vector<Pictures::Wish> wishes() {
        std::vector<Pictures::Wish> all;
        for (const Places::View& view : places_of(state_).views)
            all.push_back(
                {view.panel,
                 scene_of(state_, work_.subject().grid, view.panel, work_.session().scene(), false),
                 display_of(state_, view.panel, {0, 0})});
        return all;
    }
    // Options whose pictures are waited for by wait().
    Pictures::Options told(Pictures::Options options) {
        options.on_picture = [this] { made_.release(); };
        return options;
    }
    // Until another picture of told() has been made; false: none will be.
    bool wait(Pictures& pictures) {
        if (!pictures.failure())
            made_.acquire();
        const auto failure = pictures.failure();
        EXPECT_FALSE(failure) << failure->why;
        return !failure;
    }
    // Until every view has its full picture; all that came. Pictures of told().
    std::vector<Picture> until_complete(Pictures& pictures, size_t views) {
        std::vector<Picture> all;
        std::array<bool, kPanels.size()> complete{};
        while (std::count(complete.begin(), complete.end(), true) < static_cast<long>(views) &&
               wait(pictures))
            for (Picture& picture : pictures.take()) {
                complete[static_cast<size_t>(picture.panel)] = picture.complete;
                all.push_back(std::move(picture));
            }
        return all;
    }
    std::vector<std::byte> bytes_of(Picture& picture, GpuDevice& of) {
        if (!picture.image)
            return picture.rgba;
        Commands commands(of);
        commands.wait_for(picture.ready);
        const Commands::Region all{0, glm::uvec3(0), glm::uvec3(picture.size_px, 1)};
        const BufferSlice bytes =
            commands.read_back(*picture.image, std::span(&all, 1),
                               uint64_t{4} * picture.size_px.x * picture.size_px.y);
        commands.submit();
        commands.ticket().wait();
        return {bytes.mapped().begin(), bytes.mapped().end()};
    }
    // The volume's view, and the tool of a hand in it.
    std::vector<Pictures::Wish> with_tool(double x_mm) {
        std::vector<Pictures::Wish> all = wishes();
        all.front().scene.surfaces.push_back({.style = {.color = {0.25, 0.8, 1.0}}});
        TipMesh tip;
        all.front().meshes.push_back(tip.at(TipShape::ball, 20.0, {{x_mm, -120.0, 0.0}}));
        return all;
    }
    // For pictures with a thread, as in the window: a GpuDevice serves one thread, and tests draw
    // what they compare with on device() meanwhile.
    GpuDevice& threads_device() {
        if (!threads_device_)
            threads_device_.emplace(device());
        return *threads_device_;
    }
    Work work_;
    ViewState state_;

 private:
    std::optional<GpuDevice> threads_device_;
    std::counting_semaphore<> made_{0};
};

TEST_F(PicturesTest, AreTheRenderersWhetherTheyStayOnTheDeviceOrNot) {
    state_.stereo.on = true;
    for (const bool stay : {true, false}) {
        Pictures pictures(device(), work_.session(), {.threaded = false, .stay = stay});
        pictures.want(wishes());
        std::vector<Picture> drawn = pictures.draw().value();
        ASSERT_EQ(drawn.size(), 4u);
        Renderer renderer(device());
        for (size_t i = 0; i < drawn.size(); ++i) {
            const Pictures::Wish wish = wishes()[i];
            const Frame frame =
                renderer.render(wish.scene, {work_.loaded().data.volume, {}, {}}).value();
            const Image expected = display_image(frame.eyes, wish.display);
            EXPECT_EQ(drawn[i].image != nullptr, stay);
            const std::vector<std::byte> bytes = bytes_of(drawn[i], device());
            ASSERT_EQ(drawn[i].size_px, expected.size_px);
            size_t wrong = 0;
            for (uint32_t y = 0; y < expected.size_px.y; ++y)
                for (uint32_t x = 0; x < expected.size_px.x; ++x)
                    for (size_t c = 0; c < 3; ++c)
                        wrong += std::to_integer<uint8_t>(
                                     bytes[4 * (size_t{y} * expected.size_px.x + x) + c]) !=
                                 display_byte(expected.at(x, y, c));
            EXPECT_EQ(wrong, 0u) << name_of(drawn[i].panel);
        }
    }
}

// A thread beside the interface, on the same device: as on a graphics card.
TEST_F(PicturesTest, OfAThreadOnTheInterfacesDeviceBecomeFull) {
    Pictures full(device(), work_.session(), {.threaded = false});
    full.want(wishes());
    std::vector<Picture> expected = full.draw().value();
    Pictures pictures(threads_device(), work_.session(), told({.frame_ms = 20.0, .stay = true}));
    pictures.want(wishes());
    std::vector<Picture> last(kPanels.size());
    for (Picture& picture : until_complete(pictures, 4))
        last[static_cast<size_t>(picture.panel)] = std::move(picture);
    for (Picture& picture : expected)
        EXPECT_EQ(bytes_of(last[static_cast<size_t>(picture.panel)], device()), picture.rgba)
            << name_of(picture.panel);
    last.clear();
}

// While the camera turns and slices change without end, pictures of the volume and of the slices
// take turns: whichever wish is newest, neither kind is made twice in a row.
TEST_F(PicturesTest, NoViewWaitsForAnother) {
    constexpr size_t kTurns = 20;
    std::vector<std::vector<Pictures::Wish>> all;
    for (size_t i = 0; i < 4 * kTurns; ++i) { // of each picture another
        state_.camera = orbit(state_.camera, 1.0);
        state_.crosshair_mm =
            world_point(work_.subject().grid, glm::dvec3(10.0 + static_cast<double>(i % 20)));
        all.push_back(wishes());
    }
    std::vector<Panel> made; // in order
    std::promise<void> done;
    Pictures* of = nullptr;
    Pictures pictures(threads_device(), work_.session(),
                      {.frame_ms = 10.0, .on_picture = [&] {
                           const size_t before = made.size();
                           for (const Picture& picture : of->take())
                               if (made.size() < all.size())
                                   made.push_back(picture.panel);
                           if (made.size() < all.size())
                               of->want(all[made.size()]);
                           if (before < all.size() && (made.size() == all.size() || of->failure()))
                               done.set_value();
                       }});
    of = &pictures;
    pictures.want(all.front());
    done.get_future().wait();
    ASSERT_EQ(made.size(), all.size()) << pictures.failure().value_or(Pictures::Failure{}).why;
    // A turn is three slices, which are made together, and the volume.
    const auto first =
        static_cast<size_t>(std::find(made.begin(), made.end(), Panel::volume) - made.begin());
    ASSERT_LE(first, 3u);
    for (size_t i = 0; i < made.size(); ++i)
        EXPECT_EQ(made[i] == Panel::volume, i % 4 == first) << i;
}

// A stroke in one slice: the slices that it does not reach are not drawn, rays where it can be seen
// alone, and all views show what they would show of it from nothing.
TEST_F(PicturesTest, OfAnEditWhatItChangedIsDrawn) {
    for (const bool stay : {false, true}) {
        SCOPED_TRACE(stay);
        Pictures pictures(threads_device(), work_.session(), told({.frame_ms = 1e6, .stay = stay}));
        pictures.want(wishes());
        std::vector<Picture> last(kPanels.size());
        const auto keep = [&](std::vector<Picture> came) {
            for (Picture& picture : came)
                last[static_cast<size_t>(picture.panel)] = std::move(picture);
        };
        keep(until_complete(pictures, 4));
        // Away from the crosshair, which the other two slices run through.
        const glm::dvec3 center = state_.crosshair_mm;
        const SliceView& axial = state_.slices[0];
        const Grid& grid = work_.subject().grid;
        const double sample_mm = smallest_spacing_mm(grid);
        const double away_mm =
            kBlockSide * sample_mm; // a block of samples, which changes are told of
        for (int i = stay ? 3 : 0; i < (stay ? 6 : 3); ++i) {
            state_.tool = &kCutTool;
            state_.radius_mm = 1.5 * sample_mm;
            const glm::dvec3 at = center + (away_mm + 3.0 * sample_mm) * axial.right +
                                  (away_mm + 3.0 * sample_mm + i * sample_mm) * axial.up;
            work_.obey(order::StrokeDown{at, double(i)}, state_);
            work_.obey(order::StrokeUp{at, double(i) + 0.5}, state_);
            const uint64_t before = work_.edited().snapshot;
            work_.session().settle();
            ASSERT_GT(work_.edited().snapshot, before);
            std::array<size_t, kPanels.size()> made{};
            while ((made[0] == 0 || made[3] == 0) && wait(pictures))
                for (Picture& picture : pictures.take()) {
                    ++made[static_cast<size_t>(picture.panel)];
                    EXPECT_TRUE(picture.complete) << name_of(picture.panel);
                    last[static_cast<size_t>(picture.panel)] = std::move(picture);
                }
            EXPECT_EQ(made[0], 1u);
            EXPECT_EQ(made[1], 0u);
            EXPECT_EQ(made[2], 0u);
            EXPECT_EQ(made[3], 1u);
            Pictures anew(device(), work_.session(), {.threaded = false});
            anew.want(wishes());
            const std::vector<Picture> expected = anew.draw().value();
            for (const Picture& picture : expected)
                EXPECT_EQ(bytes_of(last[static_cast<size_t>(picture.panel)], device()),
                          picture.rgba)
                    << name_of(picture.panel);
        }
    }
}

// A 3D cursor that moves casts no rays: nothing is refined anew, and the picture stays full.
TEST_F(PicturesTest, MarksAreMovedOverThePictureThatIsThere) {
    state_.stereo.on = true;
    Pictures pictures(threads_device(), work_.session(), told({.frame_ms = 10.0}));
    pictures.want(wishes());
    until_complete(pictures, 4);
    for (int i = 0; i < 5; ++i) {
        state_.cursor_mm = glm::dvec3(10.0 * i, 0.0, 0.0);
        pictures.want(wishes());
        std::vector<Picture> came;
        while (came.empty() && wait(pictures))
            came = pictures.take();
        ASSERT_EQ(came.size(), 1u);
        EXPECT_EQ(came.front().panel, Panel::volume);
        EXPECT_TRUE(came.front().complete);
    }
}

// The volume is not drawn anew for settings that only slices show.
TEST_F(PicturesTest, TheVolumeIsNotDrawnForTheWindowOfSlices) {
    const auto scene = [&](Panel panel) {
        return scene_of(state_, work_.subject().grid, panel, work_.session().scene(), true);
    };
    const Scene volume = scene(Panel::volume), slice = scene(Panel::axial);
    state_.window.high += 50.0;
    state_.label_opacity = 0.9;
    state_.outline_px = 3.0;
    EXPECT_EQ(scene(Panel::volume), volume);
    EXPECT_NE(scene(Panel::axial), slice);
    state_.slices_in_volume = true;
    EXPECT_NE(scene(Panel::volume), volume);
}

// A figure has the pixels that `render` would write, whatever views show meanwhile.
TEST_F(PicturesTest, AFigureForPrintIsTheRenderersPictureWithItsMarks) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "figure.png";
    for (const bool transparent : {false, true}) {
        Pictures::Wish wish = wishes().front();
        wish.scene.size_px = {300, 200};
        wish.scene.background = glm::dvec3(transparent ? 0.0 : 1.0);
        const PictureLook look{.transparent = transparent,
                               .figure = {.letters = true, .transparent = transparent}};
        Pictures pictures(threads_device(), work_.session(), {});
        pictures.want(wishes());
        const auto printed = [&](const std::filesystem::path& to) {
            std::promise<Result<void>> outcome;
            pictures.print(
                {wish, look, to, [&](Result<void> result) { outcome.set_value(result); }});
            return outcome.get_future().get();
        };
        ASSERT_TRUE(printed(path));
        const Image seen = load_png(path).value();
        Renderer renderer(device());
        Frame frame = renderer.render(wish.scene, {work_.loaded().data.volume, {}, {}}).value();
        ASSERT_TRUE(save_png(path, shown_picture(look, wish.scene, frame.eyes, true)));
        EXPECT_EQ(seen.samples, load_png(path).value().samples);
        EXPECT_EQ(seen.channels.size(), transparent ? 4u : 3u);
        EXPECT_FALSE(printed("/nonexistent/figure.png")) << "a refusal, and the thread goes on";
    }
}

// The tool of a hand moves over a document that stays.
TEST_F(PicturesTest, TheToolIsSeenWhereItHasMoved) {
    state_.layout = Layout::volume;
    Pictures pictures(threads_device(), work_.session(), told({.frame_ms = 10.0}));
    for (const double x_mm : {-60.0, 60.0}) {
        pictures.want(with_tool(x_mm));
        Picture seen = std::move(until_complete(pictures, 1).back());
        Pictures fresh(device(), work_.session(), {.threaded = false});
        fresh.want(with_tool(x_mm));
        Picture wanted = std::move(fresh.draw().value().front());
        EXPECT_EQ(bytes_of(seen, device()), bytes_of(wanted, device())) << x_mm;
    }
}

// The tool moves, and cuts: no picture of fewer rays comes where there is time to draw what has
// changed.
TEST_F(PicturesTest, AToolThatMovesLeavesTheRestOfThePictureAsItIs) {
    state_.layout = Layout::volume;
    std::mutex mutex;
    std::vector<bool> complete; // each picture that came since the last wish
    std::counting_semaphore<> told{0};
    Pictures* made = nullptr;
    Pictures pictures(threads_device(), work_.session(),
                      {.frame_ms = 1e6, .on_picture = [&] {
                           const std::scoped_lock held(mutex);
                           for (const Picture& picture : made->take())
                               complete.push_back(picture.complete);
                           told.release();
                       }});
    made = &pictures;
    const auto pictures_until_full = [&] {
        for (;;) {
            told.acquire();
            const std::scoped_lock held(mutex);
            if ((!complete.empty() && complete.back()) || made->failure())
                return std::exchange(complete, {});
        }
    };
    pictures.want(with_tool(-60.0));
    ASSERT_FALSE(pictures_until_full().empty());
    pictures.want(with_tool(60.0));
    EXPECT_EQ(pictures_until_full(), std::vector<bool>{true});
    state_.tool = &kCutTool;
    state_.radius_mm = 10.0;
    work_.obey(order::StrokeDown{state_.crosshair_mm, 1.0}, state_);
    work_.obey(order::StrokeUp{state_.crosshair_mm, 1.0}, state_);
    work_.session().settle();
    ASSERT_EQ(work_.edited().undo_steps, 1u);
    EXPECT_EQ(pictures_until_full(), std::vector<bool>{true});
}

// A hand that never rests: what a first picture of fewer rays left is refined meanwhile.
TEST_F(PicturesTest, APictureIsRefinedWhileAToolMoves) {
    state_.layout = Layout::volume;
    constexpr size_t kMost = 20;
    std::vector<std::vector<Pictures::Wish>> wishes;
    for (size_t i = 0; i <= kMost; ++i)
        wishes.push_back(with_tool(-60.0 + 5.0 * static_cast<double>(i)));
    std::promise<size_t> refined; // after so many moves
    size_t moves = 0;
    bool told = false;
    Pictures* made = nullptr;
    Pictures pictures(threads_device(), work_.session(),
                      {.frame_ms = 1e6, .on_picture = [&] {
                           for (const Picture& picture : made->take()) {
                               if (told)
                                   continue;
                               told = picture.complete || moves == kMost;
                               if (told)
                                   refined.set_value(moves);
                               else
                                   made->want(wishes[++moves]);
                           }
                       }});
    made = &pictures;
    pictures.want(wishes[0]);
    EXPECT_EQ(refined.get_future().get(), 1u);
}

// An atlas too small for what is seen takes many parts: a picture of them is given up for the next.
TEST_F(PicturesTest, APictureInPartsIsGivenUpForAnotherWish) {
    constexpr size_t kWishes = 10;
    Work work(Source{open_synthetic("synthetic:phantom?size=160")}, {800, 600}, 1.0, false);
    state_ = work.subject().home;
    state_.layout = Layout::volume;
    std::vector<std::vector<Pictures::Wish>> all;
    for (size_t i = 0; i <= kWishes; ++i) {
        state_.camera = orbit(state_.camera, 5.0);
        all.push_back(
            {{Panel::volume,
              scene_of(state_, work.subject().grid, Panel::volume, work.session().scene(), false),
              {}}});
    }
    // On the thread that draws: with the second part of each picture comes another wish.
    Pictures* of = nullptr;
    std::atomic<size_t> wished = 0;
    std::vector<size_t> parts; // of each picture that was begun
    Pictures::Options options;
    options.renderer.residency = Residency::atlas;
    options.renderer.most_resident_bricks = 40;
    options.renderer.progress = [&](double share) {
        if (share == 0.0)
            parts.push_back(0);
        ++parts.back();
        if (share > 0.0 && wished > 0 && wished < kWishes)
            of->want(all[++wished]);
        return true;
    };
    Pictures pictures(threads_device(), work.session(), told(std::move(options)));
    of = &pictures;
    pictures.want(all.front());
    until_complete(pictures, 1);
    parts.clear();
    pictures.want(all[++wished]);
    size_t made = 0;
    while ((wished < kWishes || made == 0) && wait(pictures))
        made += pictures.take().size();
    EXPECT_EQ(made, 1u); // the last wish's
    ASSERT_EQ(parts.size(), kWishes);
    EXPECT_GT(parts.back(), 2u);
    parts.pop_back();
    EXPECT_EQ(parts, std::vector<size_t>(kWishes - 1, 2));
}

} // namespace
} // namespace palpate::view
