#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <tuple>
#include <vector>

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

    // A renderer that makes no pipeline anew which another of these has made, on that device with
    // those options, in any test of the program: on CPU drivers that takes longer than most
    // pictures. Options of values alone.
    static Renderer kept_renderer(GpuDevice& on, const RendererOptions& options) {
        const auto values = [](const RendererOptions& o) {
            return std::tuple(o.volume_format, o.memory_limit_bytes, o.skipping, o.residency,
                              o.most_resident_bricks, o.sampling, o.frames_in_flight,
                              o.stored_gradients, o.block_maker);
        };
        auto& all = kept_renderers();
        auto found = std::find_if(all.begin(), all.end(), [&](const KeptRenderer& one) {
            return one.on == &on && values(one.options) == values(options);
        });
        if (found == all.end())
            found =
                all.insert(all.end(), {&on, options, &KeptForTests<Renderer>::make([&on, options] {
                                           return std::make_unique<Renderer>(on, options);
                                       })});
        return Renderer(found->kept->get().store());
    }
    static Renderer kept_renderer(const RendererOptions& options = {}) {
        return kept_renderer(device(), options);
    }
    // Frees what they hold on their devices.
    static void drop_kept_renderers() {
        for (const KeptRenderer& one : kept_renderers())
            one.kept->TearDown();
    }

    // A picture's size; under PALPATE_SMALL, for slow devices, half as many pixels each way. What
    // is checked, and within what bounds, stays the same.
    static glm::uvec2 size_or_half(glm::uvec2 size_px) {
        return std::getenv("PALPATE_SMALL") ? (size_px + 1u) / 2u : size_px;
    }

 private:
    struct KeptRenderer {
        GpuDevice* on;
        RendererOptions options;
        KeptForTests<Renderer>* kept;
    };
    static std::vector<KeptRenderer>& kept_renderers() {
        static std::vector<KeptRenderer> all;
        return all;
    }

    size_t messages_before_ = 0;
};

} // namespace palpate
