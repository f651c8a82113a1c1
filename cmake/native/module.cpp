#include "module.h"

#include <algorithm>

#include "opcodes.h"

namespace translator {

namespace {

// Instructions that are of one type and have a result; the others that have a result have no type.
bool has_type(uint32_t op) {
    return op == kUndef || op == kExtInst || (op >= kConstantTrue && op <= kFunction) ||
           op == kVariable || op == kImageTexelPointer || op == kLoad || op == kAccessChain ||
           op == kArrayLength || (op >= kVectorExtractDynamic && op <= kImageRead) ||
           (op >= kImage && op <= kBitCount) || op == kAtomicLoad ||
           (op >= kAtomicExchange && op <= kPhi) ||
           (op >= kGroupNonUniformElect && op <= kCopyLogical);
}

bool is_type(uint32_t op) {
    return op >= kTypeVoid && op <= kTypeFunction;
}

void parse_global(Module& module, const Instruction& one) {
    switch (one.op) {
        case kName:
            module.names[one.in[0]] = reinterpret_cast<const char*>(&one.in[1]);
            break;
        case kDecorate:
            module.decorations[one.in[0]][one.in[1]] = one.in.size() > 2 ? one.in[2] : 0;
            break;
        case kMemberDecorate:
            module.member_decorations[{one.in[0], one.in[1]}][one.in[2]] =
                one.in.size() > 3 ? one.in[3] : 0;
            break;
        case kExecutionMode:
        case kExecutionModeId:
            if (one.in[1] == 17 || one.in[1] == 38) // LocalSize and LocalSizeId
                for (uint32_t axis = 0; axis < 3; ++axis)
                    module.group_size[axis] = one.in[2 + axis];
            module.has_group_ids |= one.in[1] == 38;
            break;
        default:
            if (is_type(one.op) || (one.op >= kConstantTrue && one.op <= kSpecConstantOp) ||
                one.op == kVariable || one.op == kUndef) {
                module.made[one.id] = one;
                module.order.push_back(one.id);
            }
    }
}

} // namespace

std::vector<uint32_t> Block::successors() const {
    switch (end.op) {
        case kBranch:
            return {end.in[0]};
        case kBranchConditional:
            return {end.in[1], end.in[2]};
        case kSwitch: {
            std::vector<uint32_t> all{end.in[1]};
            for (size_t i = 3; i < end.in.size(); i += 2)
                all.push_back(end.in[i]);
            return all;
        }
        default:
            return {};
    }
}

std::set<uint32_t> bindings_of(const Words& words) {
    std::set<uint32_t> all;
    for (size_t i = 5; i < words.size() && words[i] >> 16 != 0; i += words[i] >> 16)
        if ((words[i] & 0xffff) == kDecorate && i + 3 < words.size() && words[i + 2] == kBinding)
            all.insert(words[i + 3]);
    return all;
}

Module parse(const Words& words) {
    if (words.size() < 5 || words[0] != 0x07230203)
        fail("expected SPIR-V of this machine's byte order, found {} words", words.size());
    Module module;
    Block* block = nullptr;
    uint32_t functions = 0;
    for (size_t i = 5; i < words.size();) {
        const uint32_t length = words[i] >> 16;
        if (length == 0 || length > words.size() - i)
            fail("the instruction at word {} is cut off", i);
        Instruction one{.op = words[i] & 0xffff};
        size_t at = i + 1;
        const bool typed = has_type(one.op);
        if (typed)
            one.type = words[at++];
        if (typed || is_type(one.op) || one.op == kLabel)
            one.id = words[at++];
        one.in.assign(words.begin() + static_cast<ptrdiff_t>(at),
                      words.begin() + static_cast<ptrdiff_t>(i + length));
        i += length;
        if (one.op == kFunction)
            ++functions;
        if (functions == 0) {
            parse_global(module, one);
            continue;
        }
        if (one.op == kLabel) {
            block = &module.blocks[one.id];
            block->id = one.id;
            if (module.first_block == 0)
                module.first_block = one.id;
        } else if (one.op == kPhi) {
            block->phis.push_back(one);
        } else if (one.op == kSelectionMerge) {
            block->merge = one.in[0];
        } else if (one.op == kLoopMerge) {
            block->merge = one.in[0];
            block->continues = one.in[1];
        } else if ((one.op >= kBranch && one.op <= kUnreachable)) {
            block->end = one;
        } else if (one.op == kVariable) {
            module.made[one.id] = one;
            module.order.push_back(one.id);
        } else if (one.op != kFunction && one.op != kFunctionEnd && block) {
            module.has_barrier |= one.op == kControlBarrier;
            block->body.push_back(one);
        }
    }
    if (functions != 1)
        fail("expected one function, found {}", functions);
    return module;
}

const Instruction& Module::at(uint32_t id) const {
    const auto found = made.find(id);
    if (found == made.end())
        fail("%{} is no type, constant or variable", id);
    return found->second;
}

bool Module::is_decorated(uint32_t id, uint32_t decoration) const {
    const auto found = decorations.find(id);
    return found != decorations.end() && found->second.contains(decoration);
}

uint32_t Module::decoration(uint32_t id, uint32_t decoration) const {
    if (!is_decorated(id, decoration))
        fail("%{} lacks decoration {}", id, decoration);
    return decorations.at(id).at(decoration);
}

uint32_t Module::constant(uint32_t id) const {
    if (op(id) != kConstant)
        fail("expected a constant, found {} of %{}", name_of(op(id)), id);
    return at(id).in[0];
}

bool Module::is_wide(uint32_t type) const {
    const auto found = made.find(type);
    return found != made.end() && found->second.op == kTypeInt && found->second.in[0] == 64;
}

bool Module::has_wide() const {
    return std::any_of(order.begin(), order.end(), [&](uint32_t id) { return is_wide(id); });
}

std::string Module::scalars(uint32_t type) const {
    const Instruction& t = at(type);
    std::string all;
    const auto repeat = [&](uint32_t part, uint32_t count) {
        const std::string one = scalars(part);
        for (uint32_t i = 0; i < count; ++i)
            all += one;
    };
    switch (t.op) {
        case kTypeBool:
            return "b";
        case kTypeInt:
        case kTypeFloat:
            if (is_wide(type))
                return "uu";
            if (t.in[0] != 32)
                fail("numbers of {} bits", t.in[0]);
            return t.op == kTypeInt ? "u" : "f";
        case kTypeVector:
        case kTypeMatrix:
            if (is_wide(t.in[0]))
                fail("a vector of integers of 64 bits");
            repeat(t.in[0], t.in[1]);
            return all;
        case kTypeArray:
            repeat(t.in[0], constant(t.in[1]));
            return all;
        case kTypeStruct:
            for (const uint32_t member : t.in)
                all += scalars(member);
            return all;
        default:
            fail("a value of {}", name_of(t.op));
    }
}

uint32_t Module::part_type(uint32_t type, uint32_t index) const {
    return op(type) == kTypeStruct ? at(type).in.at(index) : at(type).in[0];
}

uint32_t Module::part_first(uint32_t type, uint32_t index) const {
    if (op(type) != kTypeStruct)
        return index * static_cast<uint32_t>(scalars(at(type).in[0]).size());
    uint32_t first = 0;
    for (uint32_t i = 0; i < index; ++i)
        first += static_cast<uint32_t>(scalars(at(type).in[i]).size());
    return first;
}

void Module::offsets(uint32_t type, uint32_t first, uint32_t matrix_stride, Words& out) const {
    const Instruction& t = at(type);
    switch (t.op) {
        case kTypeBool:
        case kTypeInt:
        case kTypeFloat:
        case kTypeVector:
            for (uint32_t i = 0; i < scalars(type).size(); ++i)
                out.push_back(first + i);
            return;
        case kTypeMatrix:
            for (uint32_t i = 0; i < t.in[1]; ++i)
                offsets(t.in[0], first + i * matrix_stride / 4, 0, out);
            return;
        case kTypeArray:
            for (uint32_t i = 0; i < constant(t.in[1]); ++i)
                offsets(t.in[0], first + i * stride_words(type), matrix_stride, out);
            return;
        case kTypeStruct:
            for (uint32_t i = 0; i < t.in.size(); ++i)
                offsets(t.in[i], first + member_word(type, i), member_matrix_stride(type, i), out);
            return;
        default:
            fail("{} in memory", name_of(t.op));
    }
}

// Types of shared memory have no layout of their own: they are packed.
uint32_t Module::stride_words(uint32_t type) const {
    return is_decorated(type, kArrayStride) ? decoration(type, kArrayStride) / 4
                                            : static_cast<uint32_t>(scalars(at(type).in[0]).size());
}

uint32_t Module::member_word(uint32_t type, uint32_t index) const {
    const auto found = member_decorations.find({type, index});
    if (found != member_decorations.end() && found->second.contains(kOffset))
        return found->second.at(kOffset) / 4;
    return part_first(type, index);
}

uint32_t Module::member_matrix_stride(uint32_t type, uint32_t index) const {
    const auto found = member_decorations.find({type, index});
    return found != member_decorations.end() && found->second.contains(kMatrixStride)
               ? found->second.at(kMatrixStride)
               : 0;
}

uint32_t Module::block_words(uint32_t type) const {
    const Instruction& t = at(type);
    if (t.op == kTypeRuntimeArray)
        return 0;
    if (t.op == kTypeStruct) {
        uint32_t end = 0;
        for (uint32_t i = 0; i < t.in.size(); ++i)
            if (op(t.in[i]) != kTypeRuntimeArray) {
                Words all;
                offsets(t.in[i], member_word(type, i), member_matrix_stride(type, i), all);
                end = std::max(end, all.empty() ? 0 : all.back() + 1);
            }
        return end;
    }
    Words all;
    offsets(type, 0, 0, all);
    return all.empty() ? 0 : all.back() + 1;
}

} // namespace translator
