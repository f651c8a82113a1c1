// Tests of what commands are recorded into: memory, descriptors and timestamps that are used again,
// and only when the device is past them.

#include "engine/gpu/commands.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>

#include "tests/gpu/created.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

class CommandsTest : public GpuTest {
 protected:
    static uint64_t staging_bytes() {
        uint64_t sum = 0;
        for (const ResourceInfo& resource : device().resources())
            if (resource.kind == kStagingKind)
                sum += resource.bytes;
        return sum;
    }
    static std::vector<std::byte> random_bytes(size_t count, uint32_t seed) {
        std::mt19937 random(seed);
        std::vector<std::byte> bytes(count);
        for (std::byte& byte : bytes)
            byte = std::byte(random());
        return bytes;
    }
    static bool equal(std::span<const std::byte> a, std::span<const std::byte> b) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end());
    }
};

// Each upload is read by a submission that has much to copy first: memory that is written again
// before the device has read it shows in the copy.
TEST_F(CommandsTest, UploadMemoryIsWrittenAgainOnlyBehindTheDevice) {
    Buffer much(device(), "much", uint64_t{16} << 20, Memory::device);
    Buffer more(device(), "more", much.bytes(), Memory::device);
    struct Sent {
        std::byte value;
        BufferSlice out;
        std::unique_ptr<Commands> commands;
    };
    std::vector<Sent> all;
    std::mt19937 random(4);
    for (int i = 0; i < 60; ++i) {
        auto commands = std::make_unique<Commands>(device());
        const std::vector<std::byte> bytes(1 + random() % 100000, std::byte(i + 1));
        Buffer to(device(), "to", bytes.size(), Memory::device);
        commands->copy(much, more);
        commands->copy(commands->upload(bytes), to);
        const BufferSlice out = commands->read_back(to);
        commands->submit();
        all.push_back({std::byte(i + 1), out, std::move(commands)});
    }
    for (const Sent& sent : all) {
        sent.commands->finish();
        const auto read = sent.out.mapped();
        EXPECT_TRUE(std::all_of(read.begin(), read.end(), [&](std::byte byte) {
            return byte == sent.value;
        })) << int(sent.value);
    }
}

TEST_F(CommandsTest, AreRecordedIntoWhatWasMadeBefore) {
    Buffer to(device(), "to", 100000, Memory::device);
    const auto run = [&](uint32_t seed) {
        const std::vector<std::byte> bytes = random_bytes(to.bytes(), seed);
        Commands commands(device());
        commands.begin_pass("all");
        commands.copy(commands.upload(bytes), to);
        const BufferSlice out = commands.read_back(to);
        commands.end_pass();
        commands.submit();
        EXPECT_EQ(commands.finish().size(), 1u);
        EXPECT_TRUE(equal(out.mapped(), bytes));
    };
    run(1);
    const CreatedObjects created;
    for (uint32_t i = 2; i < 100; ++i)
        run(i);
    EXPECT_EQ(created.count(), 0u);
}

// The test of frames relies on it: nothing that is made escapes the count, nor the engine's own.
TEST_F(CommandsTest, WhatIsMadeIsCounted) {
    const GpuDevice::Created before = device().created();
    const CreatedObjects created;
    Buffer buffer(device(), "one", 100, Memory::device);  // and its memory
    GpuImage image(device(), "two", {.size = {4, 4, 1}}); // and memory and view
    const Sampler sampler(device(), SampleFilter::linear, Edge::clamp);
    EXPECT_EQ(created.count(), 6u);
    EXPECT_EQ(created.allocations(), 2u);
    EXPECT_EQ(device().created().objects - before.objects, 6u);
    EXPECT_EQ(device().created().allocations - before.allocations, 2u);
}

// Validation ends the test where the buffer is destroyed while commands refer to it.
TEST_F(CommandsTest, WhatIsDroppedWhileItIsRecordedLivesUntilItWasUsed) {
    const std::vector<std::byte> bytes = random_bytes(5000, 7);
    Commands commands(device());
    std::optional<BufferSlice> out;
    {
        Buffer dropped(device(), "dropped", bytes.size(), Memory::device);
        commands.copy(commands.upload(bytes), dropped);
        out = commands.read_back(dropped);
    }
    Commands other(device());
    other.submit();
    other.finish();
    commands.submit();
    commands.finish();
    EXPECT_TRUE(equal(out->mapped(), bytes));
}

// Eleven and a half batches, and no more memory on its way than for three.
// A slot has room for the times of some passes; more take another.
TEST_F(CommandsTest, HaveAsManyPassesAsOneLikes) {
    Buffer buffer(device(), "buffer", 4, Memory::device);
    Commands commands(device());
    constexpr uint32_t kPasses = 150;
    for (uint32_t pass = 0; pass < kPasses; ++pass) {
        commands.begin_pass(std::to_string(pass));
        commands.fill(buffer, std::span(&pass, 1));
        commands.end_pass();
    }
    const BufferSlice out = commands.read_back(buffer);
    commands.submit();
    const std::vector<PassTime> times = commands.finish();
    ASSERT_EQ(times.size(), kPasses);
    for (uint32_t pass = 0; pass < kPasses; ++pass)
        EXPECT_EQ(times[pass].name, std::to_string(pass));
    const uint32_t last = kPasses - 1;
    EXPECT_EQ(std::memcmp(out.mapped().data(), &last, sizeof last), 0);
}

TEST_F(CommandsTest, LargeUploadsTravelInBatches) {
    const std::vector<std::byte> bytes = random_bytes(46 << 20, 9);
    Buffer to(device(), "to", bytes.size() + 100, Memory::device);
    const uint64_t before = staging_bytes(), submitted = device().last_submitted();
    Commands commands(device());
    commands.upload(bytes, to, 100);
    EXPECT_EQ(device().last_submitted() - submitted, 11u); // the rest is recorded
    EXPECT_LE(staging_bytes(), std::max(before, uint64_t{12} << 20));
    const BufferSlice out = commands.read_back(to);
    commands.submit();
    commands.finish();
    EXPECT_TRUE(equal(out.mapped().subspan(100), bytes));
}

// Two bytes a texel; pieces of 16 x 16 x 8 texels, 4 KiB, of which those at the end are cut.
TEST_F(CommandsTest, ImagesAreFilledPieceByPiece) {
    const glm::uvec3 size(250, 130, 90), piece(16, 16, 8), count((size + piece - 1u) / piece);
    GpuImage to(device(), "to",
                {.type = VK_IMAGE_TYPE_3D, .format = VK_FORMAT_R16_UNORM, .size = size});
    const auto value = [&](glm::uvec3 at) {
        return static_cast<uint16_t>(at.x * 7919u + at.y * 104729u + at.z * 1299709u);
    };
    Commands commands(device());
    size_t filled = 0;
    commands.upload(
        to, size_t{count.x} * count.y * count.z, 4096,
        [&](size_t first, size_t pieces, std::span<std::byte> bytes) {
            EXPECT_EQ(first, filled);
            EXPECT_EQ(bytes.size(), pieces * 4096);
            filled += pieces;
            std::vector<Commands::Region> regions;
            auto* out = reinterpret_cast<uint16_t*>(bytes.data());
            for (size_t i = first; i < filled; ++i) {
                const glm::uvec3 low = piece * glm::uvec3(i % count.x, i / count.x % count.y,
                                                          i / (size_t{count.x} * count.y));
                for (uint32_t texel = 0; texel < 2048; ++texel)
                    *out++ = value(low + glm::uvec3(texel % 16, texel / 16 % 16, texel / 256));
                regions.push_back({.buffer_offset = (i - first) * 4096,
                                   .image_offset = low,
                                   .size = glm::min(piece, size - low),
                                   .row_texels = 16,
                                   .plane_rows = 16});
            }
            return regions;
        });
    EXPECT_EQ(filled, size_t{count.x} * count.y * count.z);
    const Commands::Region all{.buffer_offset = 0, .image_offset = {}, .size = size};
    const BufferSlice out =
        commands.read_back(to, {&all, 1}, uint64_t{2} * size.x * size.y * size.z);
    commands.submit();
    commands.finish();
    const auto* found = reinterpret_cast<const uint16_t*>(out.mapped().data());
    size_t wrong = 0;
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                wrong += *found++ != value({x, y, z});
    EXPECT_EQ(wrong, 0u);
}

} // namespace
} // namespace palpate
