#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

// SPIR-V as the translator needs it: instructions of one function in blocks, and what stands
// before.
namespace translator {

template <class... Arguments>
[[noreturn]] void fail(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
    throw std::runtime_error(fmt::format(text, std::forward<Arguments>(arguments)...));
}

using Words = std::vector<uint32_t>;

// An instruction: its words behind the first, with type and result taken out.
struct Instruction {
    uint32_t op = 0, type = 0, id = 0;
    Words in;
};

struct Block {
    uint32_t id = 0;
    std::vector<Instruction> phis, body;
    uint32_t merge = 0;     // of OpSelectionMerge or OpLoopMerge
    uint32_t continues = 0; // of OpLoopMerge: the block is a loop's header
    Instruction end;
    std::vector<uint32_t> successors() const;
};

struct Module {
    std::map<uint32_t, Instruction> made; // types, constants and variables by id
    std::map<uint32_t, std::map<uint32_t, uint32_t>> decorations;
    std::map<std::pair<uint32_t, uint32_t>, std::map<uint32_t, uint32_t>> member_decorations;
    std::map<uint32_t, std::string> names;
    std::vector<uint32_t> order; // of `made`
    std::map<uint32_t, Block> blocks;
    uint32_t first_block = 0;
    uint32_t group_size[3] = {1, 1, 1}; // numbers, or ids of constants
    bool has_group_ids = false;
    bool has_barrier = false;

    const Instruction& at(uint32_t id) const;
    uint32_t op(uint32_t id) const { return at(id).op; }
    bool is_decorated(uint32_t id, uint32_t decoration) const;
    // Fails where there is none.
    uint32_t decoration(uint32_t id, uint32_t decoration) const;
    uint32_t constant(uint32_t id) const; // the bits of OpConstant
    bool is_wide(uint32_t type) const;    // an integer of 64 bits
    bool has_wide() const;
    // Scalars in a value of a type, in memory order: f(loat), u(int), b(ool). An integer of 64 bits
    // is two, the low one first.
    std::string scalars(uint32_t type) const;
    // The type of a part, and the scalars that lie before it in the flattened value.
    uint32_t part_type(uint32_t type, uint32_t index) const;
    uint32_t part_first(uint32_t type, uint32_t index) const;
    // Offsets in 32-bit words of a value's scalars in a block.
    void offsets(uint32_t type, uint32_t first, uint32_t matrix_stride, Words& out) const;
    uint32_t stride_words(uint32_t type) const; // of an array
    uint32_t member_word(uint32_t type, uint32_t index) const;
    uint32_t member_matrix_stride(uint32_t type, uint32_t index) const;
    // Words of a block or of shared memory, but for an array of open length at its end.
    uint32_t block_words(uint32_t type) const;
};

Module parse(const Words& words);
// The numbers of all bindings that a module declares.
std::set<uint32_t> bindings_of(const Words& words);

} // namespace translator
