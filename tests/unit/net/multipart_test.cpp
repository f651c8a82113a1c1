#include "engine/net/multipart.h"

#include <gmock/gmock.h>

#include "engine/net/bytes.h"
#include "tests/unit/net/wire.h"

namespace palpate {

namespace {

using testing::HasSubstr;

std::string refusal(std::string_view type, std::string_view body) {
    const auto result = read_multipart(type, bytes_of(body));
    return result ? "" : result.error().message;
}

// The body that requests_toolbelt, which MONAI Label answers with, makes of a field and a file.
TEST(Multipart, FieldsAndFilesAreRead) {
    const std::string body =
        "--bd1\r\nContent-Disposition: form-data; name=\"params\"\r\n"
        "Content-Type: application/json\r\n\r\n{\"a\": 1}\r\n"
        "--bd1\r\nContent-Disposition: form-data; name=\"image\"; filename=\"a b.nii.gz\"\r\n"
        "Content-Type: application/gzip\r\n\r\n\x1f\x8b\r\n--not\r\n\r\n--bd1--\r\n";
    const auto parts =
        read_multipart("multipart/form-data; charset=x; boundary=\"bd1\"", bytes_of(body));
    ASSERT_TRUE(parts) << parts.error().message;
    ASSERT_EQ(parts->size(), 2u);
    EXPECT_EQ((*parts)[0].name, "params");
    EXPECT_EQ((*parts)[0].filename, "");
    EXPECT_EQ((*parts)[0].type, "application/json");
    EXPECT_EQ(text_of((*parts)[0].bytes), "{\"a\": 1}");
    EXPECT_EQ((*parts)[1].name, "image");
    EXPECT_EQ((*parts)[1].filename, "a b.nii.gz");
    EXPECT_EQ(text_of((*parts)[1].bytes), "\x1f\x8b\r\n--not\r\n");
}

TEST(Multipart, WhatIsWrittenIsReadBack) {
    std::mt19937 random(5);
    for (int trial = 0; trial < 50; ++trial) {
        std::vector<wire::Bytes> bytes;
        std::vector<Part> parts;
        for (size_t i = 0; i < 1 + random() % 4; ++i)
            bytes.push_back(wire::some_bytes(random, random() % 500));
        // A part that holds what the body's own marks look like.
        const std::string mark = "\r\n--palpate-boundary-00000000--\r\n";
        const auto* first = reinterpret_cast<const std::byte*>(mark.data());
        bytes.push_back({first, first + mark.size()});
        for (size_t i = 0; i < bytes.size(); ++i)
            parts.push_back({"part" + std::to_string(i), i % 2 ? "a.nii.gz" : "",
                             i % 3 ? "application/octet-stream" : "", bytes[i]});
        const MultipartBody body = write_multipart(parts);
        const auto read = read_multipart(body.content_type, body.bytes);
        ASSERT_TRUE(read) << read.error().message;
        ASSERT_EQ(read->size(), parts.size());
        for (size_t i = 0; i < parts.size(); ++i) {
            EXPECT_EQ((*read)[i].name, parts[i].name);
            EXPECT_EQ((*read)[i].filename, parts[i].filename);
            EXPECT_EQ((*read)[i].type, parts[i].type);
            EXPECT_EQ(text_of((*read)[i].bytes), text_of(parts[i].bytes));
        }
    }
}

TEST(Multipart, DamagedBodiesAreNamed) {
    EXPECT_THAT(refusal("application/json", ""), HasSubstr("of several parts"));
    EXPECT_THAT(refusal("multipart/form-data", ""), HasSubstr("boundary"));
    EXPECT_THAT(refusal("multipart/form-data; boundary=b", "none"), HasSubstr("boundary b"));
    EXPECT_THAT(refusal("multipart/form-data; boundary=b", "--b\r\nA: b\r\n\r\nx"),
                HasSubstr("at the end"));
    EXPECT_THAT(refusal("multipart/form-data; boundary=b", "--b\r\n\r\nx\r\n--b--"),
                HasSubstr("with a name"));
    EXPECT_THAT(refusal("multipart/form-data; boundary=b", "--b\r\n--b--"), HasSubstr("header"));
}

} // namespace

} // namespace palpate
