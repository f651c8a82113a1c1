// Questions and messages about a file that was read: a label map, one image of many, a
// second volume that holds labels.

#include <fstream>

#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

namespace fs = std::filesystem;

// Every sample of the left half is label 3, and of the right one 7, but for a rim of 0.
Volume two_labels(const Grid& grid) {
    return make_volume(grid, ScalarType::u8, [&](glm::uvec3 at) {
        const bool inside = at.y > 3 && at.y + 3 < grid.size.y;
        return !inside ? 0.0 : at.x < grid.size.x / 2 ? 3.0 : 7.0;
    });
}

Volume grey_values(const Grid& grid) {
    return make_volume(grid, ScalarType::i16,
                       [](glm::uvec3 at) { return 7.0 * at.x - 5.0 * at.y + 11.0 * at.z; });
}

Source source_of(const std::string& path, const Volume& volume) {
    Source source{open_synthetic("synthetic:ball?size=24")};
    source.scene.file.volume = path;
    source.scene.loaded.data.volume = volume;
    source.scene.loaded.modality.clear();
    return source;
}

// Files: map.nii holds labels for the volume that is open, far.nii labels that lie elsewhere,
// slice.dcm an image alone. What lies beside the volume is read as map.nii.
class FileQuestions : public ViewerTest {
 protected:
    void SetUp() override {
        ViewerTest::SetUp();
        const Grid here = open_synthetic("synthetic:phantom?size=24").loaded.data.volume.grid();
        set_options([here](ViewerOptions& options) {
            options.open = [here](const std::string& path, const std::string&,
                                  const std::stop_token&, const std::function<void(double)>&) {
                Grid grid = here;
                if (path == "far.nii")
                    grid.world_from_index[3] += glm::dvec4(1e4, 0.0, 0.0, 0.0);
                if (!path.ends_with(".nii")) { // an image, or the folder
                    grid.size.z = path.ends_with(".dcm") ? 1 : 3;
                    return Result<Source>(source_of(path, grey_values(grid)));
                }
                return Result<Source>(source_of(path, two_labels(grid)));
            };
        });
        set_beside([here](const std::string&, bool) {
            return Result<LoadedVolume>(LoadedVolume{two_labels(here), {}, {}, {}, {}, {}});
        });
        open("synthetic:phantom?size=24");
    }
    void drop(const std::string& path) {
        frame({{.kind = Event::Kind::drop, .paths = {path}}});
        frame({});
    }
    bool has(const std::string& id) { return viewer().interface().widgets().contains(id); }
    double label_at(glm::uvec3 at) {
        const auto labels = viewer().work().labels();
        return labels ? labels->value(at) : 0.0;
    }
    std::string path() { return viewer().work().path(); }
};

constexpr glm::uvec3 kLeft(2, 12, 12), kRight(20, 12, 12);

TEST_F(FileQuestions, ALabelMapIsLaidOverTheVolumeThatIsOpen) {
    const Volume before = viewer().work().grey();
    drop("map.nii");
    ASSERT_TRUE(has("question/over"));
    EXPECT_TRUE(viewer().work().grey().is_same_as(before)); // nothing is lost before an answer
    click_widget("question/over");
    frame({});
    EXPECT_TRUE(viewer().work().grey().is_same_as(before));
    EXPECT_EQ(label_at(kLeft), 3.0);
    EXPECT_EQ(label_at(kRight), 7.0);
    EXPECT_FALSE(state().file_question);
}

TEST_F(FileQuestions, ALabelMapIsOpenedByItselfWhereAPersonSaysSo) {
    drop("map.nii");
    ASSERT_TRUE(has("question/instead"));
    click_widget("question/instead");
    frame({});
    EXPECT_EQ(path(), "map.nii");
    EXPECT_FALSE(state().file_question);
}

TEST_F(FileQuestions, NothingChangesWhereTheQuestionIsClosed) {
    const std::string before = path();
    for (const bool by_key : {true, false}) {
        drop("map.nii");
        ASSERT_TRUE(has("question/cancel"));
        if (by_key)
            key("escape");
        else
            click_widget("question/cancel");
        frame({});
        EXPECT_FALSE(state().file_question);
        EXPECT_EQ(path(), before);
        EXPECT_FALSE(viewer().work().has_labels());
    }
    drop("map.nii"); // it is asked anew
    EXPECT_TRUE(has("question/over"));
}

TEST_F(FileQuestions, LabelsThatLieElsewhereAreOpenedByThemselves) {
    drop("far.nii");
    EXPECT_FALSE(state().file_question);
    EXPECT_EQ(path(), "far.nii");
}

TEST_F(FileQuestions, AnExampleThatIsThereToTryIsReplaced) {
    set_options([](ViewerOptions& options) {
        options.asks_for_file = true;
        options.open = [](const std::string& path, const std::string&, const std::stop_token&,
                          const std::function<void(double)>&) {
            const Grid grid = open_synthetic("synthetic:phantom?size=24").loaded.data.volume.grid();
            return Result<Source>(source_of(path, two_labels(grid)));
        };
    });
    open("synthetic:phantom?size=24");
    drop("map.nii");
    EXPECT_FALSE(state().file_question);
    EXPECT_EQ(path(), "map.nii");
}

// Edits would be lost by another volume, but not by labels over this one.
TEST_F(FileQuestions, LabelsMayBeLaidOverAVolumeWithEdits) {
    note_name(1, "liver");
    frame({});
    drop("map.nii");
    ASSERT_TRUE(has("leave/over"));
    click_widget("leave/over");
    frame({});
    EXPECT_FALSE(state().leaving);
    EXPECT_EQ(path(), "synthetic:phantom?size=24");
    EXPECT_EQ(label_at(kLeft), 3.0);
}

TEST_F(FileQuestions, WhatHoldsNoLabelsIsNotOfferedAsLabels) {
    for (const std::string& path :
         {std::string("scene.json"), std::string("synthetic:ball?size=24"),
          std::string("picture.png"), std::string(::testing::TempDir())}) {
        open("synthetic:phantom?size=24");
        note_name(1, "liver");
        frame({});
        drop(path);
        ASSERT_TRUE(has("leave/save")) << path;
        EXPECT_FALSE(has("leave/over")) << path;
    }
}

TEST_F(FileQuestions, ASecondVolumeThatHoldsLabelsBecomesLabels) {
    const auto open_second = [&] {
        show("slices");
        click_widget("slices/open");
        frame({});
        frame({{.kind = Event::Kind::text, .text = "/map.nii"}});
        frame({});
        key("enter");
        frame({});
        frame({});
    };
    open_second();
    EXPECT_FALSE(viewer().work().session().scene().fusion);
    EXPECT_EQ(label_at(kRight), 7.0);
    // Labels that are there stay, and a person is told where to replace them.
    const Volume before = *viewer().work().labels();
    open_second();
    EXPECT_TRUE(viewer().work().labels()->is_same_as(before));
    EXPECT_FALSE(viewer().work().session().scene().fusion);
    EXPECT_NE(viewer().interface().message().find("labels of a file"), std::string::npos);
}

class ImagesOfAFolder : public FileQuestions {
 protected:
    void SetUp() override {
        FileQuestions::SetUp();
        folder_ = fs::path(::testing::TempDir()) / "palpate_images_of_a_folder";
        fs::remove_all(folder_);
        fs::create_directories(folder_);
        for (const char* name : {"1.dcm", "2.dcm", "3.dcm", "notes.txt"})
            std::ofstream(folder_ / name) << "12345";
    }
    void TearDown() override {
        FileQuestions::TearDown();
        fs::remove_all(folder_);
    }
    fs::path folder_;
};

TEST_F(ImagesOfAFolder, OneOfThemOffersTheSeries) {
    drop((folder_ / "2.dcm").string());
    ASSERT_TRUE(state().file_question);
    EXPECT_EQ(state().file_question->images, 3u);
    click_widget("question/series");
    frame({});
    EXPECT_EQ(path(), folder_.string());
}

TEST_F(ImagesOfAFolder, OneAloneOffersNone) {
    fs::remove(folder_ / "1.dcm");
    fs::remove(folder_ / "3.dcm");
    drop((folder_ / "2.dcm").string());
    EXPECT_FALSE(state().file_question);
}

// The next document has other labels, which the part of a name would leave out.
TEST_F(FileQuestions, WhatWasSoughtAmongLabelsIsForgottenWithThem) {
    note_name(4, "spleen");
    frame({});
    show("labels");
    click_widget("labels/find");
    frame({{.kind = Event::Kind::text, .text = "spl"}});
    frame({});
    EXPECT_FALSE(has("labels/row/1"));
    click_widget("labels/row/4"); // the field lets go
    drop("far.nii");
    click_widget("leave/discard");
    frame({});
    frame({});
    ASSERT_EQ(path(), "far.nii");
    EXPECT_TRUE(has("labels/row/1"));
}

} // namespace
} // namespace palpate::view
