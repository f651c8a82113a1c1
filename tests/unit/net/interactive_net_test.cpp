#include "engine/net/interactive_net.h"

#include <gmock/gmock.h>

#include <thread>

#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/net/fake_server.h"

namespace palpate {

namespace {

using testing::AllOf;
using testing::HasSubstr;

Volume slanted_volume() {
    return make_volume(make_grid(kSentSize, {1, 1, 2}), ScalarType::i16,
                       [](glm::uvec3 at) { return double(at.x * at.y) - 3.0 * at.z; });
}

using Mask = std::vector<uint8_t>;

Mask mask_where(const std::function<bool(glm::ivec3)>& holds) {
    Mask mask;
    for (int z = 0; z < int(kSentSize.z); ++z)
        for (int y = 0; y < int(kSentSize.y); ++y)
            for (int x = 0; x < int(kSentSize.x); ++x)
                mask.push_back(holds({x, y, z}));
    return mask;
}

bool in_box(glm::ivec3 at, glm::ivec3 first, glm::ivec3 size) {
    return glm::all(glm::greaterThanEqual(at, first)) && glm::all(glm::lessThan(at, first + size));
}

class InteractiveClient : public TemporaryFolder {
 protected:
    FakeServer fake_{file("interactive"), {}};

    // A net that has been sent the volume; null where that failed.
    std::unique_ptr<InteractiveNet> ready(NetServer server) const {
        auto net = InteractiveNet::connect(std::move(server), {});
        EXPECT_TRUE(net) << net.error().message;
        if (!net)
            return nullptr;
        const auto sent = (*net)->set_image(slanted_volume(), {});
        EXPECT_TRUE(sent) << sent.error().message;
        return std::move(*net);
    }
    std::unique_ptr<InteractiveNet> ready() const { return ready(fake_.server()); }
    // Waits until the server has seen a request.
    void await(const std::string& request) const {
        while (fake_.requests().find(request) == std::string::npos)
            std::this_thread::yield();
    }
};

Mask copy_of(const InteractiveNet& net) {
    return {net.mask().begin(), net.mask().end()};
}

TEST_F(InteractiveClient, AnswersToHintsBecomeTheMask) {
    const auto net = ready();
    ASSERT_TRUE(net);
    EXPECT_EQ(net->abilities().license, "CC BY-NC-SA 4.0");
    EXPECT_EQ(net->abilities().version, "2.2");
    EXPECT_TRUE(net->abilities().undo);
    EXPECT_FALSE(net->abilities().lassos);
    EXPECT_EQ(copy_of(*net), Mask(20 * 16 * 12));

    ASSERT_TRUE(net->add_point({5, 6, 4}, true, {}));
    const auto one = mask_where([](glm::ivec3 at) { return in_ball(at, {5, 6, 4}); });
    EXPECT_EQ(copy_of(*net), one);
    ASSERT_TRUE(net->add_point({19, 0, 11}, true, {})); // its box ends at the faces
    ASSERT_TRUE(net->undo({}));
    EXPECT_EQ(copy_of(*net), one);
    ASSERT_TRUE(net->add_box({{4, 6, 3}, {9, 1, 7}}, true, {}));
    const auto with_box = [&](glm::ivec3 at) {
        return in_ball(at, {5, 6, 4}) || in_box(at, {4, 6, 3}, {9, 1, 7});
    };
    EXPECT_EQ(copy_of(*net), mask_where(with_box));
    // A stroke that is no box, taken out of the object.
    const auto in_stroke = [](glm::ivec3 at) { return at.x == at.y && at.z % 3 == 1; };
    ASSERT_TRUE(net->add_scribble(mask_where(in_stroke), false, {}));
    EXPECT_EQ(copy_of(*net),
              mask_where([&](glm::ivec3 at) { return with_box(at) && !in_stroke(at); }));
    ASSERT_TRUE(net->reset({}));
    EXPECT_EQ(copy_of(*net), Mask(20 * 16 * 12));
    ASSERT_TRUE(net->set_start(one, {}));
    EXPECT_EQ(copy_of(*net), one);
    ASSERT_TRUE(net->add_lasso(mask_where(in_stroke), true, {}));
    EXPECT_EQ(copy_of(*net), mask_where([&](glm::ivec3 at) {
                  return in_ball(at, {5, 6, 4}) || in_stroke(at);
              }));
}

// Every fault of a hint's answer ends in one sentence that says what it is; the mask stays.
TEST_F(InteractiveClient, FaultsAreSentencesAndChangeNothing) {
    const auto net = ready();
    ASSERT_TRUE(net);
    ASSERT_TRUE(net->add_point({5, 6, 4}, true, {}));
    const Mask before = copy_of(*net);
    const std::pair<const char*, const char*> faults[] = {
        {"302", "points elsewhere"},
        {"400", "refuses (400: as told)"},
        {"401", "another key"},
        {"403", "another key"},
        {"404", "does not know this"},
        {"410", "the lease has ended"},
        {"413", "too large"},
        {"418", "refuses (418"},
        {"500", "has failed"},
        {"503", "full; try again later"},
        {"cut", "found: "},
        {"close", "found: "},
        {"damage", "expected an array"},
        {"shape", "expected an array"},
        {"outside", "expected the box"},
        {"endless", "found more"},
    };
    for (const auto& [fault, sentence] : faults) {
        fake_.set_faults({std::string(fault) + "=/add_"});
        for (const bool is_point : {true, false}) {
            const Result<void> result = is_point ? net->add_point({9, 9, 9}, true, {})
                                                 : net->add_scribble(before, false, {});
            ASSERT_FALSE(result) << fault;
            EXPECT_THAT(result.error().message, AllOf(HasSubstr(fake_.url()), HasSubstr(sentence)));
            EXPECT_EQ(result.error().message.find('\n'), std::string::npos);
            EXPECT_EQ(copy_of(*net), before) << fault;
        }
    }
    fake_.set_faults({}); // it goes on afterwards
    EXPECT_TRUE(net->add_point({9, 9, 9}, true, {}));
}

TEST_F(InteractiveClient, SilenceIsASentenceAndChangesNothing) {
    NetServer server = fake_.server();
    server.limits.quiet = std::chrono::milliseconds(1000);
    const auto net = ready(server);
    ASSERT_TRUE(net);
    fake_.set_faults({"silence=/add_"});
    const Result<void> result = net->add_point({9, 9, 9}, true, {});
    ASSERT_FALSE(result);
    EXPECT_THAT(result.error().message,
                AllOf(HasSubstr(fake_.url()), HasSubstr("silence for 1 s")));
    EXPECT_EQ(copy_of(*net), Mask(20 * 16 * 12));
}

TEST_F(InteractiveClient, ServersThatRefuseToBeginAreNamed) {
    const auto refusal = [&](const char* fault) {
        fake_.set_faults({fault});
        const auto net = InteractiveNet::connect(fake_.server(), {});
        return net ? "" : net.error().message;
    };
    EXPECT_THAT(refusal("503=/claim"), HasSubstr("full"));
    EXPECT_THAT(refusal("401=/claim"), HasSubstr("another key"));
    EXPECT_THAT(refusal("notjson=/claim"), HasSubstr(fake_.url()));
    EXPECT_THAT(refusal("410=/capabilities"), HasSubstr("lease"));
    EXPECT_THAT(refusal("damage=/capabilities"), HasSubstr(fake_.url()));
    // A lease that was claimed before the failure is given back.
    EXPECT_THAT(fake_.requests(), HasSubstr("POST /release"));
}

TEST_F(InteractiveClient, TheLeaseIsKeptAliveAndGivenBack) {
    {
        const auto net = ready();
        await("POST /heartbeat");
        const auto left_s = net->heartbeat({});
        ASSERT_TRUE(left_s);
        EXPECT_EQ(*left_s, 599.0);
    }
    EXPECT_THAT(fake_.requests(), testing::EndsWith("POST /release 0 -\n"));
}

TEST_F(InteractiveClient, TheKeyIsSent) {
    NetServer server = fake_.server();
    server.key = "abc123";
    ASSERT_TRUE(ready(server));
    EXPECT_THAT(fake_.requests(), HasSubstr("POST /claim 0 Bearer abc123\n"));
}

TEST_F(InteractiveClient, AStopEndsAnAnswerThatIsAwaited) {
    const auto net = ready();
    ASSERT_TRUE(net);
    fake_.set_faults({"silence=/add_point"});
    std::stop_source stop;
    const std::jthread person([&] {
        await("POST /add_point");
        stop.request_stop();
    });
    const Result<void> result = net->add_point({5, 6, 4}, true, stop.get_token());
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().message, "stopped before it was done");
}

TEST_F(InteractiveClient, ALostServerIsNamed) {
    const auto net = ready();
    ASSERT_TRUE(net);
    fake_.end();
    const Result<void> result = net->add_point({5, 6, 4}, true, {});
    ASSERT_FALSE(result);
    EXPECT_THAT(result.error().message, HasSubstr(fake_.url()));
    EXPECT_EQ(copy_of(*net), Mask(20 * 16 * 12));
}

} // namespace

} // namespace palpate
