// Only those tiles of a new frame are drawn that differ, and of these only those that a target
// lacks are copied there.

#include <imgui/imgui.h>

#include <memory>
#include <random>

#include "apps/view/drawing/ui_tiles.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

class UiDrawingTest : public ViewerTest {
 protected:
    // Expects a frame that is drawn upon the one before to equal all of it drawn anew. `before` and
    // `older` show the last frame and the one before it, or what they showed in another size.
    void expect_the_same(const char* what) {
        ASSERT_TRUE(viewer().draw_pictures()) << what;
        frame({});
        std::swap(before_, older_);
        if (!before_ || glm::uvec2(before_->image.shape().size) != state().size_px)
            before_ = std::make_unique<UiTarget>(new_target());
        UiTarget fresh = new_target();
        const std::vector<std::byte> upon = shown_on(*before_);
        EXPECT_TRUE(upon == shown_on(fresh)) << what << ": another target";
        viewer().forget_drawing();
        UiTarget anew = new_target();
        EXPECT_TRUE(upon == shown_on(anew)) << what;
    }

 private:
    UiTarget new_target() {
        return {GpuImage(device(), "frame",
                         {.format = VK_FORMAT_R8G8B8A8_UNORM,
                          .size = glm::uvec3(state().size_px, 1),
                          .attachment = true})};
    }

    std::vector<std::byte> shown_on(UiTarget& target) {
        Commands commands(device());
        viewer().record(commands, target);
        const glm::uvec3 size = target.image.shape().size;
        const Commands::Region all{0, glm::uvec3(0), size};
        const BufferSlice texels =
            commands.read_back(target.image, std::span(&all, 1), uint64_t{4} * size.x * size.y);
        commands.submit();
        commands.ticket().wait();
        const std::span<const std::byte> bytes = texels.mapped();
        return {bytes.begin(), bytes.end()};
    }

    std::unique_ptr<UiTarget> before_, older_;
};

// UiDrawingTest takes over 5 s of a processor: each frame of a session is drawn twice, by its
// changes and whole.
TEST_F(UiDrawingTest, ChangesUponTheFrameBeforeLookAsIfAllWereDrawn) {
    open();
    expect_the_same("opened");
    for (const char* name :
         {"l", "l", "l", "t", "t", "2", "b", "=", "x", "s", "m", "f", "escape"}) {
        key(name);
        expect_the_same(name);
    }
    key("/", {.shift = true});
    expect_the_same("keys shown");
    key("escape");
    expect_the_same("keys hidden");
    for (const char* scale : {"file/text/1.5", "file/text/1"}) { // all is drawn by another drawing
        show("appearance");
        click_widget("file/text");
        click_widget(scale);
        expect_the_same(scale);
    }
    for (const Panel panel : {Panel::axial, Panel::coronal, Panel::volume}) {
        move(middle(panel) + 20.0);
        expect_the_same("pointer");
        button(true);
        move(middle(panel) - glm::dvec2(31.0, 17.0));
        expect_the_same("drag");
        button(false);
        expect_the_same("released");
    }
    for (const glm::uvec2 size : {glm::uvec2(900, 610), glm::uvec2(700, 500)}) {
        frame({{.kind = Event::Kind::resize, .size_px = size}});
        expect_the_same("another size");
    }
    for (const auto& [id, box] : std::map(viewer().interface().widgets())) {
        move(glm::dvec2(box.low_px) + 3.0);
        expect_the_same(id.c_str());
    }
}

TEST_F(UiDrawingTest, APageOfOneViewLeavesTheToolsAsTheyAre) {
    open();
    move(middle(Panel::axial));
    frame({});
    const UiTiles before = tiles_of(viewer().interface().lists());
    frame({{.kind = Event::Kind::wheel, .wheel = {0.0, 1.0}}});
    frame({});
    const UiTiles now = tiles_of(viewer().interface().lists());
    const std::vector<Box> boxes = changes(before, now);
    ASSERT_FALSE(boxes.empty()); // the number of the slice
    const Box tools = places_of(state()).tools;
    for (const Box& box : boxes) {
        const glm::ivec2 low = glm::max(box.low_px, tools.low_px);
        const glm::ivec2 high = glm::min(box.low_px + box.size_px, tools.low_px + tools.size_px);
        // A tile that lies upon the border belongs to both.
        EXPECT_FALSE(high.x - low.x > UiTiles::kEdge_px && high.y > low.y)
            << box.low_px.x << " " << box.low_px.y << " " << box.size_px.x << " " << box.size_px.y;
    }
}

TEST_F(UiDrawingTest, ANewPictureOfATextureCountsAsAChange) {
    open();
    ASSERT_TRUE(viewer().draw_pictures());
    frame({}); // the view shows its picture now
    const ImDrawData& lists = viewer().interface().lists();
    const uint32_t axial = Interface::texture_of(Panel::axial);
    const auto versions = [&](uint64_t of_axial) {
        return tiles_of(lists, [=](uint32_t number) { return number == axial ? of_axial : 7; });
    };
    EXPECT_TRUE(changes(versions(1), versions(1)).empty());
    const std::vector<Box> boxes = changes(versions(1), versions(2));
    const Box view = box_of(state(), Panel::axial).value();
    int64_t area = 0;
    for (const Box& box : boxes) {
        area += int64_t{box.size_px.x} * box.size_px.y;
        EXPECT_LT(box.low_px.x, view.low_px.x + view.size_px.x);
        EXPECT_LT(box.low_px.y, view.low_px.y + view.size_px.y);
    }
    EXPECT_GE(area, int64_t{view.size_px.x} * view.size_px.y);
}

// In any pattern of changes each tile that differs lies in one rectangle, and no tile in two.
TEST(UiTiles, RectanglesHoldWhatDiffersOnce) {
    std::mt19937 random(11);
    for (int round = 0; round < 200; ++round) {
        UiTiles before{glm::ivec2(1 + random() % 900, 1 + random() % 700), {}};
        const glm::ivec2 count = before.count();
        before.hashes.assign(static_cast<size_t>(count.x * count.y), 5);
        UiTiles now = before;
        const unsigned share = 1 + random() % 40; // of 40 tiles
        for (uint64_t& hash : now.hashes)
            hash += random() % 40 < share ? 1 : 0;
        std::vector<int> held(now.hashes.size());
        const std::vector<Box> boxes = changes(before, now);
        EXPECT_LE(boxes.size(), kMostChanges);
        for (const Box& box : boxes) {
            const glm::ivec2 high = box.low_px + box.size_px;
            EXPECT_TRUE(high.x <= now.size_px.x && high.y <= now.size_px.y);
            for (int y = box.low_px.y; y < high.y; y += UiTiles::kEdge_px)
                for (int x = box.low_px.x; x < high.x; x += UiTiles::kEdge_px)
                    ++held[static_cast<size_t>(y / UiTiles::kEdge_px * count.x +
                                               x / UiTiles::kEdge_px)];
        }
        for (size_t i = 0; i < held.size(); ++i) {
            EXPECT_LE(held[i], 1);
            EXPECT_TRUE(held[i] == 1 || now.hashes[i] == before.hashes[i]);
        }
    }
}

TEST(UiTiles, AnotherSizeChangesAllOfTheWindow) {
    const UiTiles before{{100, 80}, std::vector<uint64_t>(4, 1)};
    const UiTiles now{{120, 80}, std::vector<uint64_t>(4, 1)};
    EXPECT_EQ(changes(before, now), (std::vector<Box>{{{0, 0}, {120, 80}}}));
}

} // namespace
} // namespace palpate::view
