#include "engine/base/memory.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <memory>
#include <vector>

#include "engine/base/memory_limit.h"

namespace palpate {
namespace {

TEST(Memory, IsWhatAMachineMayHave) {
    EXPECT_GE(physical_memory_bytes(), uint64_t{1} << 26);
    EXPECT_LE(physical_memory_bytes(), uint64_t{1} << 50);
}

TEST(Memory, IsRefusedBeforeItIsTaken) {
    EXPECT_TRUE(expect_memory("little", 1e6));
    EXPECT_TRUE(expect_memory("all of it", 1000.0, 1000));
    EXPECT_EQ(expect_memory("more", 1024.0 * 1.5, 1024).error().message,
              "more: needs 1.5 KiB of memory, and the limit is 1 KiB (--max-memory)");
    const Result<void> far = expect_memory("a result of 65536 x 65536 x 65536 samples of f32",
                                           4.0 * 65536.0 * 65536.0 * 65536.0);
    ASSERT_FALSE(far);
    EXPECT_NE(far.error().message.find("needs 1 PiB of memory, and the limit is "),
              std::string::npos);
    EXPECT_TRUE(far.error().message.ends_with("(75 % of this machine's memory)"));
    EXPECT_FALSE(expect_memory("no number", std::nan("")));
}

// Blocks of volumes, pictures and meshes are freed in another order than they were made, among
// small ones that stay. None of theirs may be kept; without return_freed_memory() glibc keeps all.
TEST(Memory, LargeBlocksGoBackToTheSystem) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer has an allocator of its own";
#endif
    return_freed_memory();
    std::make_unique<char[]>(16 * kReturnedBlockBytes); // would raise glibc's limit
    const size_t before = mallinfo2().fordblks;
    std::vector<std::unique_ptr<char[]>> large, small;
    for (int i = 0; i < 64; ++i) {
        large.push_back(std::make_unique<char[]>(kReturnedBlockBytes + 4096 * size_t(i)));
        small.push_back(std::make_unique<char[]>(1000));
    }
    EXPECT_GE(mallinfo2().hblks, 64u);
    large.clear();
    EXPECT_EQ(mallinfo2().hblks, 0u);
    EXPECT_LE(mallinfo2().fordblks, before + kReturnedBlockBytes); // free, and kept
}

} // namespace
} // namespace palpate
