#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <functional>

#include "engine/io/brick_file.h"
#include "engine/io/brick_file_layout.h"
#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using io::BrickFileHeader;

Volume small_volume() {
    return make_volume(make_grid({40, 33, 20}, {0.5, 0.5, 3.0}), ScalarType::i16,
                       [](glm::uvec3 i) { return i.x < 32 && i.y < 32 ? (i.x * i.y) % 7 : i.z; });
}

std::vector<float> all_samples(const Volume& volume) {
    const glm::uvec3 size = volume.size();
    std::vector<float> samples(sample_count(volume.grid()));
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            read_row(volume, {0, y, z}, size.x, &samples[size.x * (y + size_t{size.y} * z)]);
    return samples;
}

class BrickFileDamage : public TemporaryFolder {
 protected:
    BrickFileDamage() {
        EXPECT_TRUE(save_volume(file("good.pbv"), small_volume()));
        good_ = bytes_of("good.pbv");
        const Result<BrickFile> read = open_brick_file(file("good.pbv"));
        for (const Volume& level : levels_of(*read))
            expected_.push_back(all_samples(level));
    }

    static std::vector<Volume> levels_of(const BrickFile& file) {
        std::vector<Volume> levels{file.volume};
        levels.insert(levels.end(), file.coarser.begin(), file.coarser.end());
        return levels;
    }

    // The end of reading `bytes`: the sentence of the error, or nothing when it reads as the good
    // file does. Anything else fails the test.
    std::string outcome(const std::string& bytes) {
        write("bad.pbv", bytes);
        const Result<BrickFile> read = open_brick_file(file("bad.pbv"));
        if (!read)
            return read.error().message;
        try {
            const std::vector<Volume> levels = levels_of(*read);
            EXPECT_EQ(levels.size(), expected_.size());
            EXPECT_EQ(read->volume.grid(), small_volume().grid());
            for (size_t level = 0; level < levels.size(); ++level)
                EXPECT_EQ(all_samples(levels[level]), expected_[level]) << "silently wrong";
        } catch (const SourceError& error) {
            return error.what();
        }
        return {};
    }

    // The good file with its header changed and signed anew.
    std::string with_header(const std::function<void(BrickFileHeader&)>& change) const {
        BrickFileHeader header;
        std::memcpy(&header, good_.data(), sizeof header);
        change(header);
        header.header_crc = static_cast<uint32_t>(
            crc32_z(0, reinterpret_cast<const Bytef*>(&header), sizeof header - 4));
        std::string bytes = good_;
        std::memcpy(bytes.data(), &header, sizeof header);
        return bytes;
    }

    std::string good_;
    std::vector<std::vector<float>> expected_;
};

TEST_F(BrickFileDamage, EveryTruncationIsRefusedByName) {
    for (size_t length = 0; length < good_.size(); ++length) {
        const std::string message = outcome(good_.substr(0, length));
        ASSERT_NE(message.find("bad.pbv"), std::string::npos) << length << ": " << message;
        ASSERT_NE(message.find("expected"), std::string::npos) << length << ": " << message;
    }
    EXPECT_NE(outcome(good_ + "x").find("cut or grown"), std::string::npos);
}

TEST_F(BrickFileDamage, EveryFlippedByteIsRefusedByName) {
    EXPECT_EQ(outcome(good_), "");
    for (size_t at = 0; at < good_.size(); ++at) {
        std::string bytes = good_;
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << at % 8));
        const std::string message = outcome(bytes);
        ASSERT_NE(message.find("bad.pbv"), std::string::npos) << at << ": " << message;
    }
}

// Headers whose checksum is right and whose claims are not: nothing is allocated by them.
TEST_F(BrickFileDamage, HostileClaimsAreHeldAgainstTheFile) {
    const auto refused = [&](const std::function<void(BrickFileHeader&)>& change,
                             const std::string& words) {
        const std::string message = outcome(with_header(change));
        EXPECT_NE(message.find(words), std::string::npos) << message;
    };
    refused([](auto& h) { h.size[0] = h.size[1] = h.size[2] = 1 << 20; }, "levels");
    refused(
        [](auto& h) {
            h.size[0] = h.size[1] = h.size[2] = 1 << 20;
            h.level_count = 16;
        },
        "expected an index of");
    refused([](auto& h) { h.size[1] = 0; }, "samples on each axis, found 0");
    refused([](auto& h) { h.size[2] = ~0u; }, "samples on each axis");
    refused([](auto& h) { h.range_count = ~uint64_t{0}; }, "range tables");
    refused([](auto& h) { h.index_bytes = ~uint64_t{0} - 7; }, "index");
    refused([](auto& h) { h.index_offset = ~uint64_t{0}; }, "index at the end");
    refused([](auto& h) { h.type = 9; }, "sample type 0 .. 4, found 9");
    refused([](auto& h) { h.level_count = 60; }, "levels, found 60");
    refused([](auto& h) { h.world_from_index[0] = h.world_from_index[1] = 0; }, "three directions");
    refused([](auto& h) { h.version = 7; }, "found version 7");
}

TEST_F(BrickFileDamage, AFileCutWhileItIsReadIsNoticed) {
    write("cut.pbv", good_);
    const Result<BrickFile> read = open_brick_file(file("cut.pbv"), 0);
    ASSERT_TRUE(read) << read.error().message;
    std::filesystem::resize_file(file("cut.pbv"), good_.size() / 2);
    try {
        all_samples(read->volume);
        FAIL() << "read on";
    } catch (const SourceError& error) {
        EXPECT_NE(std::string(error.what()).find("was cut while it was read"), std::string::npos)
            << error.what();
    }
}

TEST_F(BrickFileDamage, ADamagedBrickIsNamedWhenItIsCopied) {
    std::string bytes = good_;
    bytes[sizeof(BrickFileHeader) + 20] ^= 1;
    write("bad.pbv", bytes);
    const Result<BrickFile> read = open_brick_file(file("bad.pbv"));
    ASSERT_TRUE(read) << read.error().message;
    const Result<void> saved = save_brick_file(file("out.pbv"), stream_of(read->volume));
    ASSERT_FALSE(saved);
    EXPECT_NE(
        saved.error().message.find("brick (0, 0, 0) of level 0 is damaged: expected checksum"),
        std::string::npos)
        << saved.error().message;
    EXPECT_FALSE(std::filesystem::exists(file("out.pbv")));
}

} // namespace
} // namespace palpate
