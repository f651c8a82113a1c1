// Barriers are plain data: what stands between two uses is decided without a device.

#include "engine/gpu/barrier.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(UseTracker, FirstUseOfABufferNeedsNothing) {
    UseTracker tracker;
    EXPECT_FALSE(tracker.advance(Use::uniform));
}

TEST(UseTracker, FirstUseOfAnImageChangesItsLayout) {
    UseTracker tracker;
    const auto needed = tracker.advance(Use::copy_target);
    ASSERT_TRUE(needed);
    EXPECT_EQ(needed->before.layout, VK_IMAGE_LAYOUT_UNDEFINED);
    EXPECT_EQ(needed->after.layout, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
}

TEST(UseTracker, ReadAfterReadNeedsNothingAndReadAfterWriteDoes) {
    UseTracker tracker;
    tracker.advance(Use::copy_target);
    const auto needed = tracker.advance(Use::sampled);
    ASSERT_TRUE(needed);
    EXPECT_EQ(needed->before.access, VK_ACCESS_2_TRANSFER_WRITE_BIT);
    EXPECT_EQ(needed->after.access, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT);
    EXPECT_FALSE(tracker.advance(Use::sampled));
}

TEST(UseTracker, WriteWaitsForTheReadsBeforeIt) {
    UseTracker tracker;
    tracker.advance(Use::storage_write);
    tracker.advance(Use::copy_source);
    const auto needed = tracker.advance(Use::storage_write);
    ASSERT_TRUE(needed);
    EXPECT_EQ(needed->before.stages, VK_PIPELINE_STAGE_2_COPY_BIT);
    EXPECT_EQ(needed->after.stages, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT);
}

TEST(UseTracker, WriteAfterWriteIsOrdered) {
    UseTracker tracker;
    tracker.advance(Use::storage_write);
    EXPECT_TRUE(tracker.advance(Use::storage_write));
}

// A window's image: acquired (by a semaphore that the submission waits for), drawn to, shown.
TEST(UseTracker, WhatAWindowGivesIsDrawnToAndShown) {
    UseTracker tracker;
    for (int frame = 0; frame < 2; ++frame) {
        tracker.forget();
        const auto drawn = tracker.advance(Use::color_attachment);
        ASSERT_TRUE(drawn);
        EXPECT_EQ(drawn->before.layout, VK_IMAGE_LAYOUT_UNDEFINED);
        EXPECT_NE(drawn->before.stages, VK_PIPELINE_STAGE_2_NONE) << "the semaphore's wait";
        EXPECT_EQ(drawn->after.layout, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
        const auto shown = tracker.advance(Use::present);
        ASSERT_TRUE(shown);
        EXPECT_EQ(shown->before.access & VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT,
                  VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT);
        EXPECT_EQ(shown->after.layout, VK_IMAGE_LAYOUT_PRESENT_SRC_KHR);
    }
}

// It keeps what it held when it was shown, and may be shown once more as it is.
TEST(UseTracker, AnImageThatWasShownKeepsItsContents) {
    UseTracker tracker;
    tracker.forget();
    tracker.advance(Use::copy_target);
    tracker.advance(Use::present);
    EXPECT_FALSE(tracker.advance(Use::present));
    const auto drawn = tracker.advance(Use::copy_target);
    ASSERT_TRUE(drawn);
    EXPECT_EQ(drawn->before.layout, VK_IMAGE_LAYOUT_PRESENT_SRC_KHR);
    EXPECT_NE(drawn->before.stages, VK_PIPELINE_STAGE_2_NONE) << "the semaphore's wait";
}

} // namespace
} // namespace palpate
