#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/gpu/device.h"
#include "engine/render/renderer.h"
#include "tests/support/kept_device.h"

namespace palpate {

// One device with validation and synchronisation validation for all tests of a program; a message
// fails the test that caused it.
class GpuTest : public ::testing::Test {
 protected:
    static GpuDevice& device() {
        static KeptForTests<GpuDevice>& kept = keep_device({.validation = true});
        return kept.get();
    }
    void SetUp() override { messages_before_ = device().validation_messages().size(); }
    void TearDown() override {
        const auto messages = device().validation_messages();
        for (size_t i = messages_before_; i < messages.size(); ++i)
            ADD_FAILURE() << messages[i];
    }

    // A picture's size; under PALPATE_SMALL, for slow devices, half as many pixels each way. What
    // is checked, and within what bounds, stays the same.
    static glm::uvec2 size_or_half(glm::uvec2 size_px) {
        return std::getenv("PALPATE_SMALL") ? (size_px + 1u) / 2u : size_px;
    }

 private:
    size_t messages_before_ = 0;
};

} // namespace palpate
