#include "bench/suite/conversation.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate::bench {
namespace {

class ConversationTest : public TemporaryFolder {};

TEST_F(ConversationTest, GivesTheAnswerToEachQuestion) {
    Result<Conversation> echo = Conversation::start({"cat"}, file("said"));
    ASSERT_TRUE(echo.has_value());
    Json long_one = Json::array();
    for (int i = 0; i < 20000; ++i) // more than a piece
        long_one.push_back(i);
    for (const Json& question : {Json{{"frames", 3}}, long_one, Json("ü")}) {
        const Result<Json> answer = echo->ask(question);
        ASSERT_TRUE(answer.has_value()) << answer.error().message;
        EXPECT_EQ(*answer, question);
    }
}

TEST_F(ConversationTest, SaysWhatAProgramLastSaidThatEnds) {
    Result<Conversation> gone =
        Conversation::start({"sh", "-c", "echo no display >&2"}, file("said"));
    ASSERT_TRUE(gone.has_value());
    const Result<Json> answer = gone->ask(1);
    ASSERT_FALSE(answer.has_value());
    EXPECT_EQ(answer.error().message, "it ended: no display");
}

TEST_F(ConversationTest, TakesNoOtherAnswerThanJson) {
    Result<Conversation> talker =
        Conversation::start({"sh", "-c", "read x; echo nonsense"}, file("said"));
    ASSERT_TRUE(talker.has_value());
    const Result<Json> answer = talker->ask(1);
    ASSERT_FALSE(answer.has_value());
    EXPECT_EQ(answer.error().message, "expected an answer in JSON, found 'nonsense'");
}

TEST_F(ConversationTest, DoesNotStartWhatIsNotThere) {
    EXPECT_FALSE(Conversation::start({"no-such-program"}, file("said")).has_value());
}

} // namespace
} // namespace palpate::bench
