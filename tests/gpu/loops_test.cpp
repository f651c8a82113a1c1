// Every loop of every shader is left as docs/decisions/10-loops-that-lanes-leave.md asks.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/base/file.h"
#include "spirv/left_at_its_end.h"

namespace palpate {
namespace {

// Enough of the SPIR-V specification (2.4, 3.49) to follow the blocks of a module.
enum Op : uint32_t {
    kPhi = 245,
    kLoopMerge = 246,
    kSelectionMerge = 247,
    kLabel = 248,
    kBranch = 249,
    kBranchConditional = 250,
    kStore = 62,
    kFunctionCall = 57,
    kLogicalOr = 166,
    kLogicalAnd = 167,
    kLogicalNot = 168,
    kGroupNonUniformAny = 335
};

using Instruction = std::vector<uint32_t>; // the opcode in place of the first word
struct Module {
    std::map<uint32_t, std::vector<Instruction>> blocks;
    std::map<uint32_t, Instruction> truths; // what makes a bool, by its id
};

Module parsed(std::span<const uint32_t> words) {
    Module module;
    uint32_t block = 0;
    for (size_t i = 5; i < words.size(); i += words[i] >> 16) {
        Instruction one(words.begin() + i, words.begin() + i + (words[i] >> 16));
        one[0] &= 0xffff;
        if (one[0] == kLabel)
            block = one[1];
        else if (block != 0)
            module.blocks[block].push_back(one);
        if (one[0] == kPhi || one[0] == kGroupNonUniformAny ||
            (one[0] >= kLogicalOr && one[0] <= kLogicalNot))
            module.truths[one[2]] = one;
    }
    return module;
}

// Whether a condition is a vote of the subgroup, perhaps together with others.
bool is_vote(const Module& module, uint32_t id) {
    const auto found = module.truths.find(id);
    if (found == module.truths.end())
        return false;
    const Instruction& made = found->second;
    if (made[0] == kGroupNonUniformAny)
        return true;
    const size_t stride = made[0] == kPhi ? 2 : 1;
    for (size_t i = 3; i < made.size(); i += stride)
        if (is_vote(module, made[i]))
            return true;
    return false;
}

bool leads_to(const Instruction& last, uint32_t block) {
    return (last[0] == kBranch && last[1] == block) ||
           (last[0] == kBranchConditional && (last[2] == block || last[3] == block));
}

// Whether the loop's test, from its head to the block that leaves it, stores and calls nothing.
bool tests_at_head(const Module& module, uint32_t head, uint32_t leaver) {
    for (uint32_t at = head;;) {
        const std::vector<Instruction>& block = module.blocks.at(at);
        for (const Instruction& one : block)
            if (one[0] == kStore || one[0] == kFunctionCall)
                return false;
        if (at == leaver)
            return true;
        if (block.back()[0] == kBranch)
            at = block.back()[1];
        else if (block.size() > 1 && block[block.size() - 2][0] == kSelectionMerge)
            at = block[block.size() - 2][1]; // && and ||
        else
            return false;
    }
}

struct Loops {
    int count = 0, wrong = 0;
};

Loops loops_of(std::span<const uint32_t> words) {
    const Module module = parsed(words);
    Loops loops;
    for (const auto& [head, block] : module.blocks) {
        const auto merge = std::find_if(block.begin(), block.end(), [](const Instruction& one) {
            return one[0] == kLoopMerge;
        });
        if (merge == block.end())
            continue;
        ++loops.count;
        std::vector<uint32_t> leavers;
        bool all_vote = true;
        for (const auto& [from, other] : module.blocks)
            if (leads_to(other.back(), (*merge)[1])) {
                leavers.push_back(from);
                all_vote = all_vote && other.back()[0] == kBranchConditional &&
                           is_vote(module, other.back()[1]);
            }
        const bool right =
            all_vote || (leavers.size() == 1 && tests_at_head(module, head, leavers[0]));
        loops.wrong += right ? 0 : 1;
    }
    return loops;
}

TEST(Loops, OfEveryShaderAreLeftAtTheirHeadOrByAllLanesTogether) {
    int files = 0, loops = 0;
    for (const char* folder : {PALPATE_RENDER_SPIRV, PALPATE_EXTRACT_SPIRV})
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            if (entry.path().extension() != ".spv")
                continue;
            const Result<std::string> bytes = load_text(entry.path());
            ASSERT_TRUE(bytes);
            std::vector<uint32_t> words(bytes->size() / 4);
            std::memcpy(words.data(), bytes->data(), 4 * words.size());
            const Loops found = loops_of(words);
            EXPECT_EQ(found.wrong, 0) << entry.path() << ", of " << found.count << " loops";
            ++files;
            loops += found.count;
        }
    EXPECT_GT(files, 100);
    EXPECT_GT(loops, 500);
}

// The loop that the decision's page shows is found.
TEST(Loops, OneThatIsLeftAtItsEndIsFound) {
    const Loops found = loops_of(Shader(spirv::LeftAtItsEnd{}).code->words);
    EXPECT_EQ(found.count, 1);
    EXPECT_EQ(found.wrong, 1);
}

} // namespace
} // namespace palpate
