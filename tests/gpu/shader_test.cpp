// The build reads this from a shader, and C++ cannot misunderstand it; see also wrong_shaders.

#include "engine/gpu/shader.h"
#include "engine/gpu/offer.h"

#include <gmock/gmock.h>

#include <cstring>

#include "spirv/every_kind.h"
#include "tests/gpu/every_kind.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

using testing::ElementsAre;

// "binding type bytes name", as the shader's text has it.
std::vector<std::string> slots_of(const Shader& shader) {
    std::vector<std::string> out;
    for (const BindingSlot& slot : shader.code->slots)
        out.push_back(
            fmt::format("{} {} {} {}", slot.binding, int(slot.type), slot.least_bytes, slot.name));
    return out;
}

TEST(Shader, BindingsAreThoseOfItsText) {
    constexpr int kSampled = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                  kImage = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
                  kUniform = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
                  kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    // 12 + 36 + 2 * 16 + 8, and 16 before an array of open length.
    const auto block = fmt::format("0 {} 88 Block", kUniform);
    const auto image = fmt::format("2 {} 0 image", kSampled);
    const auto target = fmt::format("4 {} 0 target", kImage);
    const auto out = fmt::format("5 {} 16 Out", kStorage);
    const auto more = fmt::format("7 {} 0 More", kStorage);
    EXPECT_EQ(sizeof(gpu::KindBlock), 88u);
    EXPECT_THAT(slots_of(spirv::EveryKind{}), ElementsAre(block, image, target, out));
    EXPECT_THAT(slots_of(spirv::EveryKind{.has_more = true}),
                ElementsAre(block, image, target, out, more));
}

TEST(Shader, ANameTellsVariantsApart) {
    EXPECT_EQ(Shader(spirv::EveryKind{}).name(), "every_kind");
    EXPECT_EQ(Shader(spirv::EveryKind{.has_more = true, .whole_number = 9}).name(),
              "every_kind has_more whole_number=9");
    EXPECT_EQ(Shader(spirv::EveryKind{}), Shader(spirv::EveryKind{.whole_number = 7, .sign = -3}));
    EXPECT_NE(Shader(spirv::EveryKind{}), Shader(spirv::EveryKind{.part = 0.5f}));
    EXPECT_NE(Shader(spirv::EveryKind{}), Shader(spirv::EveryKind{.is_on = false}));
}

class ShaderTest : public GpuTest {
 protected:
    ShaderTest()
        : block_(device(), "block", sizeof(gpu::KindBlock), Memory::upload),
          out_(device(), "out", 32, Memory::device),
          more_(device(), "more", 4, Memory::device),
          image_(device(), "image", {.format = VK_FORMAT_R8G8B8A8_UNORM, .storage = true}),
          target_(device(), "target", {.format = VK_FORMAT_R8G8B8A8_UNORM, .storage = true}),
          nearest_(device(), SampleFilter::nearest, Edge::clamp) {}

    std::vector<Bound> fitting() { // in no order
        return {bind_storage_image(gpu::kKindTarget, target_),
                bind_uniform(gpu::kKindBlock, block_),
                bind_storage(gpu::kKindOut, out_, Use::storage_write),
                bind_sampled(gpu::kKindImage, image_, nearest_)};
    }

    // The result of one invocation.
    gpu::KindOut run(const Shader& shader, const std::vector<Bound>& bound) {
        const ComputePipeline pipeline(device(), shader);
        Commands commands(device());
        commands.clear(image_, glm::vec4(0.0f));
        commands.dispatch(pipeline, bound, glm::uvec3(1));
        const BufferSlice bytes = commands.read_back(out_);
        commands.submit();
        commands.finish();
        gpu::KindOut result;
        std::memcpy(&result, bytes.mapped().data(), sizeof result);
        return result;
    }

    Buffer block_, out_, more_;
    GpuImage image_, target_;
    Sampler nearest_;
};

TEST_F(ShaderTest, ConstantsOfEveryTypeReachTheDevice) {
    const gpu::KindOut own = run(spirv::EveryKind{}, fitting());
    EXPECT_EQ(own.whole, 7u);
    EXPECT_EQ(own.is_on, 1u);
    EXPECT_EQ(own.sign, -3);
    EXPECT_EQ(own.part, 0.25f);
    const gpu::KindOut set =
        run(spirv::EveryKind{.whole_number = 4'000'000'000u, .sign = -9, .part = -1.5f, .is_on = 0},
            fitting());
    EXPECT_EQ(set.whole, 4'000'000'000u);
    EXPECT_EQ(set.is_on, 0u);
    EXPECT_EQ(set.sign, -9);
    EXPECT_EQ(set.part, -1.5f);
}

TEST_F(ShaderTest, WhatDoesNotFitAShaderIsNamed) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    std::vector<Bound> one_missing = fitting();
    one_missing.erase(one_missing.begin());
    EXPECT_DEATH(run(spirv::EveryKind{}, one_missing),
                 "every_kind: binding 4 .target.: expected a storage image, found nothing");
    EXPECT_DEATH(run(spirv::EveryKind{.has_more = true}, fitting()),
                 "every_kind has_more: binding 7 .More.: expected a storage buffer, found nothing");
    std::vector<Bound> one_more = fitting();
    one_more.push_back(bind_storage(gpu::kKindMore, more_));
    EXPECT_DEATH(run(spirv::EveryKind{}, one_more),
                 "every_kind: binding 7 .none.: expected nothing, found a storage buffer");
    std::vector<Bound> twice = fitting();
    twice.push_back(twice.back());
    EXPECT_DEATH(run(spirv::EveryKind{}, twice), "5 and 4");
    std::vector<Bound> other_kind = fitting();
    other_kind[1] = bind_storage(gpu::kKindBlock, block_);
    EXPECT_DEATH(run(spirv::EveryKind{}, other_kind),
                 "binding 0 .Block.: expected a uniform buffer, found a storage buffer");
    std::vector<Bound> no_sampler = fitting();
    no_sampler[3] = bind_storage_image(gpu::kKindImage, target_);
    EXPECT_DEATH(run(spirv::EveryKind{}, no_sampler),
                 "binding 2 .image.: expected an image with its sampler, found a storage image");
    std::vector<Bound> too_small = fitting();
    too_small[1] = bind_uniform(gpu::kKindBlock, {block_, 0, 84});
    EXPECT_DEATH(run(spirv::EveryKind{}, too_small),
                 "binding 0 .Block.: expected 88 bytes or more, found 84");
}

// What a pass offers serves every variant; one that needs what is not there is named all the same.
TEST_F(ShaderTest, AVariantTakesOfAnOfferWhatItDeclares) {
    Offer offer;
    offer.storage_image(gpu::kKindTarget, &target_)
        .uniform(gpu::kKindBlock, BufferSlice(block_))
        .storage(gpu::kKindOut, &out_, Use::storage_write)
        .sampled(gpu::kKindImage, &image_, nearest_)
        .storage(gpu::kKindMore, nullptr);
    const auto taken = [&](const Shader& shader) {
        std::vector<uint32_t> bindings;
        for (const Bound& bound : offer.taken_by(ComputePipeline(device(), shader)))
            bindings.push_back(bound.binding);
        return bindings;
    };
    const uint32_t all[] = {gpu::kKindTarget, gpu::kKindBlock, gpu::kKindOut, gpu::kKindImage,
                            gpu::kKindMore};
    EXPECT_THAT(taken(spirv::EveryKind{.has_more = true}),
                testing::ElementsAreArray(std::span(all).first(4)));
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    EXPECT_DEATH(run(spirv::EveryKind{.has_more = true},
                     offer.taken_by(ComputePipeline(device(), spirv::EveryKind{.has_more = true}))),
                 "every_kind has_more: binding 7 .More.: expected a storage buffer, found nothing");
    offer.storage(gpu::kKindMore, &more_);
    EXPECT_THAT(taken(spirv::EveryKind{.has_more = true}), testing::ElementsAreArray(all));
    EXPECT_THAT(taken(spirv::EveryKind{}), testing::ElementsAreArray(std::span(all).first(4)));
    EXPECT_EQ(run(spirv::EveryKind{}, offer.taken_by(ComputePipeline(device(), spirv::EveryKind{})))
                  .whole,
              7u);
}

} // namespace
} // namespace palpate
