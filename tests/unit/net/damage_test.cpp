#include <gmock/gmock.h>

#include "engine/base/json.h"
#include "engine/net/bytes.h"
#include "engine/net/multipart.h"
#include "engine/net/net_array.h"
#include "tests/support/given.h"
#include "tests/unit/net/wire.h"

namespace palpate {

namespace {

using wire::Bytes;

// How often replies of each kind are damaged, and read.
size_t trials() {
    return size_t(given("PALPATE_NET_MUTATIONS", 1500));
}

// A damaged array is refused, or has the elements that were asked for; nothing else happens.
TEST(Damage, ArraysAreReadOrRefused) {
    std::mt19937 random(6);
    const std::vector<int64_t> shape{4, 13, 20};
    size_t refused = 0;
    for (size_t trial = 0; trial < trials(); ++trial) {
        const Bytes data = wire::some_bytes(random, 4 * 13 * 20);
        Bytes array = wire::array_of(data, shape, "uint8", 400, {4, 120, true, trial % 2 == 0});
        for (size_t i = 0; i < 1 + random() % 3; ++i)
            wire::damage(random, array);
        const auto read = read_net_array(array, shape);
        if (read)
            EXPECT_EQ(read->size(), data.size());
        else
            EXPECT_FALSE(read.error().message.empty());
        refused += !read;
    }
    EXPECT_GT(refused, trials() / 4); // damage was reached
}

TEST(Damage, BodiesAreReadOrRefused) {
    std::mt19937 random(7);
    size_t refused = 0;
    for (size_t trial = 0; trial < trials(); ++trial) {
        const Bytes file = wire::some_bytes(random, random() % 300);
        MultipartBody body = write_multipart(std::vector<Part>{
            {"params", "", "application/json", bytes_of("{\"label\": [[1, 2, 3]]}")},
            {"image", "a.nii.gz", "application/gzip", file}});
        Bytes type(bytes_of(body.content_type).begin(), bytes_of(body.content_type).end());
        wire::damage(random, trial % 4 == 0 ? type : body.bytes);
        const auto read = read_multipart(text_of(type), body.bytes);
        refused += !read;
        size_t total = 0;
        if (read)
            for (const Part& part : *read)
                total += part.bytes.size();
        EXPECT_LE(total, body.bytes.size());
    }
    EXPECT_GT(refused, trials() / 10);
}

TEST(Damage, JsonIsReadOrRefused) {
    std::mt19937 random(8);
    const std::string good = R"({"ran_prediction": true, "bbox": [[0, 4], [2, 13], [1, 20]],
        "license": "CC BY-NC-SA 4.0", "models": {"deepedit": {"labels": {"liver": 1}}}})";
    size_t refused = 0;
    for (size_t trial = 0; trial < trials(); ++trial) {
        Bytes text(bytes_of(good).begin(), bytes_of(good).end());
        wire::damage(random, text);
        refused += !parse_json(text_of(text), "reply");
    }
    EXPECT_GT(refused, trials() / 10);
}

} // namespace

} // namespace palpate
