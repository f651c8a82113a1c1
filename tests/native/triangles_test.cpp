// Triangles of the interface on the private driver: covered pixels are counted, and random drawings
// are those of the system's driver.

#include <gmock/gmock.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <array>

#include "apps/view/drawing/ui_drawing.h"
#include "tests/native/native_fixture.h"

namespace palpate {
namespace {

constexpr glm::uvec2 kSize_px(97, 61);
using Pixel = std::array<uint8_t, 4>;

// Letters and lists that ImGui needs; a fixture of the drawing alone.
class NativeTriangles : public NativeTest {
 protected:
    void SetUp() override {
        NativeTest::SetUp();
        ImGui::CreateContext();
        ImGui::GetIO().IniFilename = nullptr;
        ImGui::GetIO().DisplaySize = ImVec2(kSize_px.x, kSize_px.y);
    }
    void TearDown() override {
        ImGui::DestroyContext();
        NativeTest::TearDown();
    }
    // One list, drawn over black.
    static std::vector<Pixel> drawn(GpuDevice& on, ImDrawList& list) {
        const auto drawing = std::make_unique<view::UiDrawing>(on, VK_FORMAT_R8G8B8A8_UNORM);
        view::UiTarget target{GpuImage(on, "target",
                                       {.format = VK_FORMAT_R8G8B8A8_UNORM,
                                        .size = glm::uvec3(kSize_px, 1),
                                        .attachment = true})};
        ImDrawList* lists[] = {&list};
        ImDrawData data;
        data.Valid = true;
        data.CmdLists = lists;
        data.CmdListsCount = 1;
        data.TotalIdxCount = list.IdxBuffer.Size;
        data.TotalVtxCount = list.VtxBuffer.Size;
        data.DisplaySize = ImVec2(kSize_px.x, kSize_px.y);
        Commands commands(on);
        drawing->record(commands, target, data);
        const Commands::Region all{0, glm::uvec3(0), glm::uvec3(kSize_px, 1)};
        const BufferSlice back =
            commands.read_back(target.image, {&all, 1}, uint64_t{4} * kSize_px.x * kSize_px.y);
        commands.submit();
        commands.ticket().wait();
        std::vector<Pixel> pixels(size_t{kSize_px.x} * kSize_px.y);
        std::memcpy(pixels.data(), back.mapped().data(), back.bytes);
        return pixels;
    }
};

constexpr ImU32 kHalfWhite = IM_COL32(255, 255, 255, 128);

// A triangle without ImGui's smoothing of its edges.
void add(ImDrawList& list, std::array<ImVec2, 3> at, std::array<ImU32, 3> colors, ImVec2 place) {
    list.PrimReserve(3, 3);
    for (size_t i = 0; i < 3; ++i)
        list.PrimVtx(at[i], place, colors[i]);
}

struct List {
    List() {
        list._ResetForNewFrame();
        list.PushClipRect({0, 0}, {kSize_px.x, kSize_px.y});
        list.PushTextureID(nullptr);
    }
    ImVec2 white = ImGui::GetIO().Fonts->TexUvWhitePixel;
    ImDrawList list{ImGui::GetDrawListSharedData()};
};

// Triangles that tile the target cover each pixel once: half white upon black is 128 there, not 192
// as where two overlap, nor 0 as where a gap is. Corners of the tiling lie at any 1/256 pixel.
TEST_F(NativeTriangles, NeighboursCoverEachPixelOnce) {
    ImGui::GetIO().Fonts->Build();
    std::mt19937 random(7);
    for (int turn = 0; turn < 20; ++turn) {
        List made;
        constexpr int kColumns = 7, kRows = 5;
        std::array<std::array<ImVec2, kColumns + 1>, kRows + 1> corners;
        for (int j = 0; j <= kRows; ++j)
            for (int i = 0; i <= kColumns; ++i) {
                const auto shift = [&](bool is_within) {
                    return is_within ? static_cast<float>(random() % 1024) / 256.0f - 2.0f : 0.0f;
                };
                corners[j][i] = {kSize_px.x * i / float{kColumns} + shift(i > 0 && i < kColumns),
                                 kSize_px.y * j / float{kRows} + shift(j > 0 && j < kRows)};
            }
        for (int j = 0; j < kRows; ++j)
            for (int i = 0; i < kColumns; ++i) {
                const std::array<ImU32, 3> colors{kHalfWhite, kHalfWhite, kHalfWhite};
                const ImVec2 a = corners[j][i], b = corners[j][i + 1], c = corners[j + 1][i],
                             d = corners[j + 1][i + 1];
                if (random() % 2) {
                    add(made.list, {a, b, c}, colors, made.white);
                    add(made.list, {d, b, c}, colors, made.white); // the other way round
                } else {
                    add(made.list, {a, b, d}, colors, made.white);
                    add(made.list, {a, c, d}, colors, made.white);
                }
            }
        for (const Pixel& pixel : drawn(device(), made.list))
            ASSERT_EQ(pixel, (Pixel{128, 128, 128, 255})) << turn;
    }
}

// Corners lie at multiples of 1/256 pixel, so that both drivers snap them to the same place. The
// bar of the interface is 1 of 255.
TEST_F(NativeTriangles, RandomOnesLookAsOnTheSystemsDriver) {
    ImGui::GetIO().Fonts->Build();
    GpuDevice other({.select = "0", .can_present = [](auto...) { return true; }});
    std::mt19937 random(8);
    const auto unit = [&] { return static_cast<float>(random() % 65536) / 65536.0f; };
    for (int turn = 0; turn < 20; ++turn) {
        List made;
        for (int i = 0; i < 3; ++i) {
            const ImVec2 low(unit() * 60 - 10, unit() * 40 - 10);
            made.list.PushClipRect(low, ImVec2(low.x + unit() * 90, low.y + unit() * 60), true);
            std::array<ImVec2, 3> at;
            std::array<ImU32, 3> colors;
            for (size_t k = 0; k < 3; ++k) {
                at[k] = {static_cast<float>(random() % (140 * 256)) / 256.0f - 20.0f,
                         static_cast<float>(random() % (100 * 256)) / 256.0f - 20.0f};
                colors[k] =
                    IM_COL32(random() % 256, random() % 256, random() % 256, random() % 256);
            }
            add(made.list, at, colors, made.white);
            made.list.PopClipRect();
        }
        made.list.AddText(ImGui::GetIO().Fonts->Fonts[0], 13.0f + 3 * unit(),
                          ImVec2(unit() * 30, unit() * 40), IM_COL32_WHITE, "Palpate 0123");
        const auto ours = drawn(device(), made.list), theirs = drawn(other, made.list);
        int most = 0;
        for (size_t i = 0; i < ours.size(); ++i)
            for (size_t k = 0; k < 4; ++k)
                most = std::max(most, std::abs(int{ours[i][k]} - int{theirs[i][k]}));
        EXPECT_LE(most, 1) << turn;
    }
}

} // namespace
} // namespace palpate
