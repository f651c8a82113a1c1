// Series in which images are there several times: one of each is read, and what differs is not
// taken for a copy.

#include <gmock/gmock.h>

#include "tests/unit/io/frame_truth.h"

namespace palpate {
namespace {

using test::DicomData;
using test::Random;
using test::Stored;
using test::Truth;
using ::testing::Contains;
using ::testing::HasSubstr;

class DicomCopies : public testing::Test {
 protected:
    // The image of a slice under a name and a UID of its own.
    void put(
        int slice, const std::string& name,
        const std::function<void(DicomData&)>& change = [](DicomData&) {}) {
        DicomData data = test::image_of(truth_, {{slice, 0}});
        data.put(8, 0x60, "CS", "CT").put(0x20, 0x13, "IS", std::to_string(slice + 1));
        data.put(0x20, 0x32, "DS", test::decimal_string(truth_.place(slice)));
        data.put(0x20, 0x37, "DS", test::decimal_string(truth_.axes()));
        test::put_spacing(truth_, data);
        change(data);
        test::write(folder_ / name, data.file(test::kCtClass, uid_of(name)));
    }
    static std::string uid_of(const std::string& name) {
        std::string uid = "1.2.3";
        for (const char c : name)
            uid += fmt::format(".{}", static_cast<int>(c));
        return uid;
    }
    void put_all(
        const std::string& prefix,
        const std::function<void(DicomData&)>& change = [](DicomData&) {}) {
        for (int slice = 0; slice < truth_.slices; ++slice)
            put(slice, fmt::format("{}{}", prefix, slice), change);
    }
    std::string error() const {
        const auto found = test::decoded(folder_.path());
        return found ? "read" : found.error().message;
    }
    std::vector<std::string> warnings() const {
        const auto found = test::decoded(folder_.path());
        return found ? found->decoded.warnings : std::vector<std::string>{found.error().message};
    }

    Truth truth_ = [] {
        Random random(4);
        Truth truth = test::random_truth(random, false);
        truth.step = std::abs(truth.step);
        return truth;
    }();
    test::Folder folder_{"copies"};
};

DicomData& other_values(DicomData& data) {
    return data.put(0x28, 0x1052, "DS", "5").put(0x28, 0x1053, "DS", "1");
}

TEST_F(DicomCopies, OfOtherInstancesWithTheSameSamplesAreLeftOut) {
    put_all("a");
    put_all("b");
    test::expect_truth(folder_.path(), truth_);
    EXPECT_THAT(
        warnings(),
        Contains(HasSubstr(fmt::format("{} images have the same samples", int{truth_.slices}))));
    // Also of some images alone, and thrice.
    put(1, "c");
    test::expect_truth(folder_.path(), truth_);
    EXPECT_THAT(warnings(), Contains(HasSubstr(fmt::format("{} images have the same samples",
                                                           int{truth_.slices} + 1))));
}

TEST_F(DicomCopies, ASingleOneIsLeftOut) {
    put_all("a");
    put(0, "b");
    test::expect_truth(folder_.path(), truth_);
    EXPECT_THAT(warnings(), Contains(HasSubstr("1 image has the same samples as others")));
    EXPECT_THAT(warnings(), Contains(HasSubstr("b repeats a0")));
}

TEST_F(DicomCopies, WithOtherValuesAreNone) {
    put_all("a");
    put_all("b", [](DicomData& data) { other_values(data); });
    EXPECT_THAT(error(), HasSubstr("no attribute tells"));
}

TEST_F(DicomCopies, OneWithOtherValuesIsNone) {
    put_all("a");
    put(1, "b", [](DicomData& data) { other_values(data); });
    EXPECT_THAT(error(), HasSubstr("duplicate positions"));
}

TEST_F(DicomCopies, ThatLostDetailGiveWayToTheirSource) {
    put_all("b");
    for (int slice = 0; slice < truth_.slices; ++slice)
        put(slice, fmt::format("a{}", slice), [&](DicomData& data) {
            DicomData source;
            source.put(8, 0x1155, "UI", uid_of(fmt::format("b{}", slice)));
            other_values(data).put(0x28, 0x2110, "CS", "01").put_items(8, 0x2112, {source});
        });
    test::expect_truth(folder_.path(), truth_);
    EXPECT_THAT(
        warnings(),
        Contains(HasSubstr(fmt::format("{} images are versions of others", int{truth_.slices}))));
}

// Alone, such images are a series like any other.
TEST_F(DicomCopies, ThatLostDetailAreReadWithoutTheirSource) {
    for (int slice = 0; slice < truth_.slices; ++slice)
        put(slice, fmt::format("a{}", slice), [&](DicomData& data) {
            DicomData source;
            source.put(8, 0x1155, "UI", uid_of(fmt::format("b{}", slice)));
            data.put(0x28, 0x2110, "CS", "01").put_items(8, 0x2112, {source});
        });
    test::expect_truth(folder_.path(), truth_);
    EXPECT_THAT(warnings(), testing::IsEmpty());
}

} // namespace
} // namespace palpate
