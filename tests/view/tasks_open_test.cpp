// Tasks 1 to 5: files are opened.

#include "engine/io/labels_write.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/view/task_session.h"

namespace palpate::view {
namespace {

class OpenTask : public Task {};

constexpr glm::uvec3 kSize(30, 26, 22);

Volume a_volume() {
    return make_volume(make_grid(kSize, glm::dvec3(2.0, 2.0, 3.0)), ScalarType::i16,
                       [](glm::uvec3 at) { return 3.0 * at.x + 5.0 * at.y + 7.0 * at.z; });
}

// Two labels, each in a half of the samples of a box.
Volume two_labels(const Grid& grid) {
    return make_volume(grid, ScalarType::u8, [&](glm::uvec3 at) {
        const bool inside = glm::all(glm::greaterThan(at, glm::uvec3(4))) &&
                            glm::all(glm::lessThan(at, grid.size - 4u));
        return !inside ? 0.0 : at.x < grid.size.x / 2 ? 1.0 : 2.0;
    });
}

// An image of a series: `series` is its number, and so is the value of its samples, but for two.
std::string image(int series, int number) {
    test::DicomData data = test::samples(8, 6, 16, 16, true);
    data.put(8, 0x60, "CS", "CT").put(8, 0x103e, "LO", fmt::format("series {}", series));
    data.put(0x20, 0x0d, "UI", "1.2.3").put(0x20, 0x0e, "UI", fmt::format("1.2.3.{}", series));
    data.put(0x20, 0x11, "IS", std::to_string(series));
    data.put(0x20, 0x13, "IS", std::to_string(number + 1));
    test::place(data, fmt::format("0\\0\\{}", 2 * number), "1\\0\\0\\0\\1\\0", "1\\1");
    data.put(0x28, 0x1052, "DS", "0").put(0x28, 0x1053, "DS", "1");
    std::vector<int> values(48, 100 * series);
    values[0] = -1000;
    values[1] = 1500;
    data.put(0x7fe0, 0x10, "OW", test::words_16(values));
    return data.file(test::kCtClass, fmt::format("1.2.3.{}.{}", series, number));
}

TEST_F(OpenTask, T01_AVolumeIsOpened) {
    ASSERT_TRUE(save_volume(folder() / "head.nii.gz", a_volume()));
    begin(open_synthetic("synthetic:phantom?size=24"), /*asks=*/true);
    play("01_open_a_volume");
    EXPECT_EQ(grid().size, kSize);
    for (const Panel panel : kPanels) // three slices and 3D
        EXPECT_TRUE(box_of(state(), panel)) << name_of(panel);
    EXPECT_FALSE(state().browser_open);
}

// Series 1 has the most images and is read at first; the list goes by their number.
TEST_F(OpenTask, T02_ASeriesOfANestedFolderIsOpened) {
    constexpr int images[] = {9, 7, 5};
    for (int series = 1; series <= 3; ++series) {
        const auto below = folder() / "patient" / "study" / fmt::format("s{}", series);
        std::filesystem::create_directories(below);
        for (int i = 0; i < images[series - 1]; ++i)
            test::write(below / fmt::format("{}.dcm", i), image(series, i));
    }
    begin(open_synthetic("synthetic:phantom?size=24"), /*asks=*/true);
    play("02_open_a_series_of_a_nested_folder");
    EXPECT_EQ(grid().size, glm::uvec3(8, 6, 7));
    EXPECT_EQ(grey().value({4, 3, 2}), 200.0f);
    EXPECT_FALSE(state().series_open);
}

TEST_F(OpenTask, T03_ALabelMapLiesOverTheVolume) {
    begin(scene_of_volume(a_volume()));
    const Volume map = two_labels(grid());
    ASSERT_TRUE(save_labels(folder() / "labels.nii.gz", map, {}));
    play("03_open_a_label_map");
    const nlohmann::json counts = dump()["label_counts"];
    const size_t half = (11 - 1) * (26 - 4 - 5) * (22 - 4 - 5);
    EXPECT_EQ(counts["1"], half);
    EXPECT_EQ(counts["2"], half + (26 - 4 - 5) * (22 - 4 - 5));
    EXPECT_TRUE(state().labels_shown);
    EXPECT_GT(state().label_opacity, 0.0);
}

TEST_F(OpenTask, T04_ASecondVolumeLiesHalfTransparentOverTheFirst) {
    begin(scene_of_volume(a_volume()));
    ASSERT_TRUE(save_volume(folder() / "second.nii.gz", a_volume()));
    play("04_open_a_second_volume");
    EXPECT_TRUE(viewer().work().session().scene().fusion);
    EXPECT_EQ(state().fusion_opacity, 0.5);
}

TEST_F(OpenTask, T05_TheVolumeOfTheLastStartIsOpenedAgain) {
    ASSERT_TRUE(save_volume(folder() / "head.nii.gz", a_volume()));
    recent_ = {(folder() / "head.nii.gz").string()};
    begin(open_synthetic("synthetic:phantom?size=24"), /*asks=*/true);
    play("05_reopen_the_last");
    EXPECT_EQ(grid().size, kSize);
    EXPECT_FALSE(state().browser_open);
}

} // namespace
} // namespace palpate::view
