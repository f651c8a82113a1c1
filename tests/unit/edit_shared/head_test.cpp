// A real head is drilled, sample by sample as the definition of each operation has it, and whole
// again after undo.

#include "engine/edit/history.h"
#include "engine/edit/stroke.h"
#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "engine/volume/content_hash.h"
#include "tests/unit/edit/twin.h"
#include "tests/unit/io_shared/shared_data.h"

namespace palpate {
namespace {

// CarvedHead takes over 5 s of a processor: a whole CT is carved and compared sample by sample.
class CarvedHead : public SharedData {
 protected:
    // The head is 205 x 205 x 140 mm; samples of 3.2 x 3.2 x 1.5 mm.
    static Volume head() { return loaded("ct_head/dicom_axial_64").volume; }

    // A press from outside the head towards its middle, turning, until well within the bone.
    static std::vector<StrokePose> drilling(const Volume& volume, glm::dvec3 from_index) {
        const glm::dvec3 middle = 0.5 * (glm::dvec3(volume.size()) - 1.0);
        std::vector<StrokePose> poses;
        for (int i = 0; i <= 12; ++i) {
            const glm::dvec3 index = glm::mix(from_index, middle, 0.05 * i);
            const double half = 0.15 * i;
            poses.push_back({0.1 * i,
                             world_point(volume.grid(), index),
                             {std::cos(half), 0.0, std::sin(half), 0.0}});
        }
        return poses;
    }

    static std::vector<Stroke> strokes(const Volume& volume) {
        const glm::dvec3 end = glm::dvec3(volume.size()) - 1.0;
        Operation cut, mill, add;
        cut.kind = OperationKind::cut;
        mill.kind = add.kind = OperationKind::mill;
        cut.to_value = mill.to_value = 0; // air in this head, whose values are HU + 1024
        mill.rates = {{-1000, 20000}, {300, 8000}, {1500, 500}}; // bone goes slowly
        mill.falloff_mm = 4.0;
        mill.only_values = std::pair{200.0, 4000.0}; // and nothing else goes
        add.to_value = 1800;
        add.rates = {{0, 3000}};
        const auto shape = [](const char* text) { return *parse_json(text, ""); };
        return {*make_stroke(shape(R"({"kind": "ball", "radius_mm": 12})"), cut,
                             drilling(volume, {0.5 * end.x, end.y, 0.5 * end.z})),
                *make_stroke(shape(R"({"kind": "burr", "radius_mm": 10, "flutes": 6})"), mill,
                             drilling(volume, {0.0, 0.5 * end.y, 0.6 * end.z})),
                *make_stroke(shape(R"({"kind": "capsule", "radius_mm": 7, "length_mm": 20})"), add,
                             drilling(volume, {end.x, 0.5 * end.y, 0.7 * end.z}))};
    }
};

TEST_F(CarvedHead, IsSampleBySampleWhatTheDefinitionsSay) {
    const Volume first = head();
    for (const Stroke& stroke : strokes(first)) {
        const Volume after = *apply_stroke(first, stroke.tool, stroke.operation, stroke.poses);
        const FlatVolume twin =
            brute_force(first, stroke.tool, stroke.operation, stroke.poses, nullptr);
        size_t changed = 0, different = 0;
        twin.for_each([&](glm::ivec3 i) {
            changed += after.value(glm::uvec3(i)) != first.value(glm::uvec3(i));
            different += after.value(glm::uvec3(i)) != float(twin[i]);
        });
        EXPECT_EQ(different, 0u) << name_of(stroke.operation.kind);
        EXPECT_GT(changed, 100u) << name_of(stroke.operation.kind);
    }
}

TEST_F(CarvedHead, IsWholeAgainAfterUndoAndCarvedAgainAfterRedo) {
    const Volume first = head();
    History history;
    std::vector<Volume> all{first};
    for (const Stroke& stroke : strokes(first)) {
        all.push_back(*apply_stroke(all.back(), stroke.tool, stroke.operation, stroke.poses));
        history.record(all[all.size() - 2], all.back());
    }
    history.settle();
    Volume now = all.back();
    for (size_t depth = all.size() - 1; depth-- > 0;) {
        now = (*history.undo(now))->first();
        EXPECT_EQ(content_hash(now), content_hash(all[depth])) << depth;
    }
    EXPECT_TRUE(changed_bricks(now, first).empty());
    for (size_t depth = 1; depth < all.size(); ++depth) {
        now = (*history.redo(now))->first();
        EXPECT_EQ(content_hash(now), content_hash(all[depth])) << depth;
    }
    EXPECT_FALSE(*history.redo(now));
}

// A stroke file from a program elsewhere does the same.
TEST_F(CarvedHead, IsTheSameFromAFileOfStrokes) {
    const Volume first = head();
    for (const Stroke& stroke : strokes(first)) {
        const auto read = parse_strokes(stroke_text(stroke), "text");
        ASSERT_TRUE(read) << read.error().message;
        const Stroke& other = read->front();
        EXPECT_EQ(content_hash(*apply_stroke(first, other.tool, other.operation, other.poses)),
                  content_hash(*apply_stroke(first, stroke.tool, stroke.operation, stroke.poses)));
    }
}

} // namespace
} // namespace palpate
