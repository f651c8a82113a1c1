#include "engine/net/ask_net.h"

#include <gmock/gmock.h>

#include <thread>

#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/net/fake_server.h"

namespace palpate {

namespace {

using testing::AllOf;
using testing::HasSubstr;

// 100 where x is above 12, else 0; the grid is turned and lies off the origin.
Volume stepped_volume() {
    Grid grid = make_grid(kSentSize, {0.7, 0.8, 2.1}, {-31, 12, 5});
    std::swap(grid.world_from_index[0], grid.world_from_index[1]);
    return make_volume(grid, ScalarType::i16,
                       [](glm::uvec3 at) { return at.x > 12 ? 100.0 : 0.0; });
}

// Compares every sample with a formula.
void expect_labels(const Result<Volume>& labels, const std::function<int(glm::ivec3)>& expected) {
    ASSERT_TRUE(labels) << labels.error().message;
    EXPECT_EQ(labels->grid(), stepped_volume().grid());
    size_t wrong = 0;
    for (uint32_t z = 0; z < kSentSize.z; ++z)
        for (uint32_t y = 0; y < kSentSize.y; ++y)
            for (uint32_t x = 0; x < kSentSize.x; ++x)
                wrong += labels->value({x, y, z}) != float(expected(glm::ivec3(x, y, z)));
    EXPECT_EQ(wrong, 0u);
}

NetSeeds two_points() {
    NetSeeds seeds;
    seeds.points[1] = {{5, 6, 4}};
    seeds.points[2] = {{8, 6, 4}};
    return seeds;
}

class AskNet : public TemporaryFolder {
 protected:
    Result<FoundNet> found(const FakeServer& fake) { return find_net(fake.server(), {}); }
};

// Each object has its points, and the other's points are not in it; where balls meet, the smaller
// label has the sample.
TEST_F(AskNet, ObjectsOfAnInteractiveNetExcludeEachOther) {
    const FakeServer fake(file("interactive"), {});
    const auto net = found(fake);
    ASSERT_TRUE(net) << net.error().message;
    EXPECT_EQ(license_sentence(*net, nullptr),
              "the licence of the net at " + fake.url() + " is CC BY-NC-SA 4.0");
    expect_labels(ask_net(*net, nullptr, stepped_volume(), two_points(), {}), [](glm::ivec3 at) {
        const bool one = in_ball(at, {5, 6, 4}), two = in_ball(at, {8, 6, 4});
        return one && !two ? 1 : two && !one ? 2 : 0;
    });
    NetSeeds drawn;
    drawn.background = 300;
    drawn.drawn = make_volume(stepped_volume().grid(), ScalarType::u16, [](glm::uvec3 at) {
        return at.x < 4 ? 7.0 : at.x > 15 ? 300.0 : 0.0;
    });
    expect_labels(ask_net(*net, nullptr, stepped_volume(), drawn, {}),
                  [](glm::ivec3 at) { return at.x < 4 ? 7 : 0; });
}

TEST_F(AskNet, ModelsOfMonaiLabelGiveTheirLabels) {
    const FakeServer fake(file("monai"), {});
    const auto net = found(fake);
    ASSERT_TRUE(net) << net.error().message;
    const auto refused = model_of(*net, "liver");
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message,
                HasSubstr("expected one of the models spleen, edit 3d, found liver"));
    const auto plain = model_of(*net, "spleen"), edit = model_of(*net, "edit 3d");
    ASSERT_TRUE(plain);
    ASSERT_TRUE(edit);
    EXPECT_THAT(license_sentence(*net, &*plain), HasSubstr("is Apache-2.0"));
    EXPECT_THAT(license_sentence(*net, &*edit), HasSubstr("states no licence"));
    for (const bool has_sessions : {true, false}) {
        fake.set_faults(has_sessions ? std::vector<std::string>()
                                     : std::vector<std::string>{"406=/session/"});
        expect_labels(ask_net(*net, &*plain, stepped_volume(), {}, {}),
                      [](glm::ivec3 at) { return at.x > 12 ? 3 : 0; });
        NetSeeds seeds;
        seeds.points[2] = {{5, 6, 4}, {9, 9, 9}};
        expect_labels(ask_net(*net, &*edit, stepped_volume(), seeds, {}), [](glm::ivec3 at) {
            return in_ball(at, {5, 6, 4}) || in_ball(at, {9, 9, 9}) ? 2 : 0;
        });
        EXPECT_EQ(fake.requests().find("DELETE /session/s%201") != std::string::npos, true);
    }
}

// The fake model answers with a ball of its other label, too, which was not asked for.
TEST_F(AskNet, ADeepeditModelGivesTheLabelsThatAreAskedFor) {
    const FakeServer fake(file("monai"), {});
    const auto net = found(fake);
    ASSERT_TRUE(net) << net.error().message;
    const auto edit = model_of(*net, "edit 3d");
    ASSERT_TRUE(edit);
    NetSeeds seeds;
    seeds.points[5] = {{12, 6, 4}};
    expect_labels(ask_net(*net, &*edit, stepped_volume(), seeds, {}), [](glm::ivec3 at) {
        return in_ball(at, {12, 6, 4}) ? 5 : 0;
    });
    seeds.points[2] = {{12, 12, 9}};
    expect_labels(ask_net(*net, &*edit, stepped_volume(), seeds, {}), [](glm::ivec3 at) {
        return in_ball(at, {12, 12, 9}) ? 2 : in_ball(at, {12, 6, 4}) ? 5 : 0;
    });
    const std::string before = fake.requests();
    seeds.points[3] = {{1, 1, 1}};
    const auto refused = ask_net(*net, &*edit, stepped_volume(), seeds, {});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message,
                HasSubstr("of the model edit 3d, 5 (liver), 2 (spleen), found label 3"));
    EXPECT_EQ(fake.requests(), before); // no sample has left
}

// A stop while the volume is on its way: the answer names the session, which is deleted.
TEST_F(AskNet, AStopLeavesNoSession) {
    const FakeServer fake(file("monai"), {});
    const auto net = found(fake);
    ASSERT_TRUE(net) << net.error().message;
    const auto model = model_of(*net, "spleen");
    ASSERT_TRUE(model);
    fake.set_faults({"held=/session/"});
    std::stop_source stop;
    const std::jthread person([&] {
        while (fake.requests().find("PUT /session/") == std::string::npos)
            std::this_thread::yield();
        stop.request_stop();
        fake.set_faults({});
    });
    const auto labels = ask_net(*net, &*model, stepped_volume(), {}, stop.get_token());
    ASSERT_FALSE(labels);
    EXPECT_EQ(labels.error().message, "stopped before it was done");
    EXPECT_THAT(fake.requests(), HasSubstr("DELETE /session/s%201"));
    EXPECT_THAT(fake.requests(), testing::Not(HasSubstr("POST /infer")));
}

TEST_F(AskNet, FaultsOfMonaiLabelAreSentences) {
    const FakeServer fake(file("monai"), {});
    const auto net = found(fake);
    ASSERT_TRUE(net) << net.error().message;
    const auto model = model_of(*net, "spleen");
    ASSERT_TRUE(model);
    const std::pair<std::string, std::string> faults[] = {
        {"401=/session/", "another key"},
        {"500=/infer", "has failed"},
        {"503=/infer", "full"},
        {"410=/infer", "ended"},
        {"cut=/infer", "found: "},
        {"close=/infer", "found: "},
        {"damage=/infer", fake.url()},
        {"endless=/infer", "found more"},
        {"notjson=/session/", fake.url()},
        {"shape=/infer", "expected labels of 20 x 16 x 12 samples, found 19 x 16 x 12"},
        {"outside=/infer", "found them elsewhere"},
    };
    for (const auto& [fault, sentence] : faults) {
        fake.set_faults({fault});
        const auto labels = ask_net(*net, &*model, stepped_volume(), {}, {});
        ASSERT_FALSE(labels) << fault;
        EXPECT_THAT(labels.error().message, AllOf(HasSubstr(fake.url()), HasSubstr(sentence)));
    }
    EXPECT_EQ(fake.requests().find("DELETE /session/s%201") != std::string::npos, true);
}

TEST(NetServer, NamesOfServersAreChecked) {
    EXPECT_EQ(server_url("gpu"), "http://gpu");
    EXPECT_EQ(server_url("gpu:1527/"), "http://gpu:1527");
    EXPECT_EQ(server_url("https://gpu.example/net"), "https://gpu.example/net");
    for (const char* wrong : {"", "http://", "ftp://gpu", "file:///etc", "http://a b", "me:pw@gpu",
                              "gpu?x", "gpu#x", "http:///x", "-o", "gpu\n"})
        EXPECT_FALSE(server_url(wrong)) << wrong;
    EXPECT_THAT(server_url("https://me:pw1@gpu").error().message,
                AllOf(HasSubstr("a password"), testing::Not(HasSubstr("pw1"))));
    EXPECT_EQ(server_key("abc\nmore"), "abc");
    EXPECT_FALSE(server_key("\n"));
    EXPECT_FALSE(server_key("a b"));
}

TEST(NetServer, SendingIsSaidInASentence) {
    const Volume volume = stepped_volume();
    EXPECT_EQ(sending_sentence(volume, {"http://gpu:1527", {}, {}, {}}),
              "all 20 x 16 x 12 samples of the volume, its place in the patient, the seeds, and "
              "labels to start from, go to http://gpu:1527, not encrypted on the way");
    EXPECT_THAT(sending_sentence(volume, {"http://gpu", "k", {}, {}}),
                testing::EndsWith("on the way, where others can read the key, too"));
    EXPECT_THAT(sending_sentence(volume, {"https://gpu", "k", {}, {}}),
                testing::EndsWith(", encrypted"));
    EXPECT_THAT(sending_sentence(volume, {"https://gpu", {}, {}, {}}), HasSubstr(", encrypted"));
}

// Else --net-timeout could ask for silence that the limit of the whole cuts short.
TEST_F(AskNet, TheWholeMayTakeAsLongAsSilence) {
    const FakeServer fake(file("interactive"), {});
    NetServer server = fake.server();
    server.limits.whole = std::chrono::milliseconds(0);
    const auto reply = ask(server, {"GET", "/healthz"}, {});
    EXPECT_TRUE(reply) << reply.error().message;
}

TEST(NetServer, AServerThatIsNotThereIsNamed) {
    const auto net = find_net({"http://127.0.0.1:1", {}, {}, {}}, {}); // nothing listens there
    ASSERT_FALSE(net);
    EXPECT_THAT(net.error().message, HasSubstr("http://127.0.0.1:1"));
}

} // namespace

} // namespace palpate
