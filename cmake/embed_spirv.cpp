// embed_spirv SHADER ROOT OUT ID [MACRO ...]
//
// Run by palpate_embed_shader() (PalpateShaders.cmake). Reads the variants OUT/ID_0.spv .. of the
// shader and writes OUT/ID.h and OUT/ID.cpp:
//
//   struct spirv::<Id>       a bool for each macro, a number for each specialization constant, and
//                            a conversion to Shader (engine/gpu/shader.h)
//   the words, and of each   bindings with their types, and constants
//   static_asserts           members of structs that the shader has from a header (.h) lie in C++
//                            where they lie in SPIR-V
//
// Exit 0 when done, else 1 with a sentence.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "native/opcodes.h"

namespace {

using namespace translator; // numbers of SPIR-V

using Strings = std::vector<std::string>;
using Decorations = std::map<uint32_t, uint32_t>; // by kind, their first operand

template <class... Arguments>
[[noreturn]] void fail(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
    throw std::runtime_error(fmt::format(text, std::forward<Arguments>(arguments)...));
}

struct Module {
    std::map<uint32_t, std::vector<uint32_t>> made; // types, constants and variables by id
    std::map<uint32_t, std::string> names;
    std::map<std::pair<uint32_t, uint32_t>, std::string> member_names;
    std::map<uint32_t, Decorations> decorations;
    std::map<std::pair<uint32_t, uint32_t>, Decorations> member_decorations;

    uint32_t op(uint32_t id) const { return made.at(id)[0]; }
    std::vector<uint32_t> members(uint32_t type) const {
        return {made.at(type).begin() + 2, made.at(type).end()};
    }
    // The size of a type in a block. A runtime array has none of its own.
    uint32_t bytes(uint32_t type, uint32_t matrix_stride = 0) const {
        const std::vector<uint32_t>& t = made.at(type);
        switch (t[0]) {
            case kTypeInt:
            case kTypeFloat:
                return t[2] / 8;
            case kTypeVector:
                return t[3] * bytes(t[2]);
            case kTypeMatrix:
                return (t[3] - 1) * matrix_stride + bytes(t[2]);
            case kTypeArray:
                return made.at(t[3])[3] * decorations.at(type).at(kArrayStride);
            case kTypeRuntimeArray:
                return 0;
            case kTypeStruct: {
                uint32_t end = 0;
                for (uint32_t i = 0; i + 2 < t.size(); ++i) {
                    const Decorations& d = member_decorations.at({type, i});
                    const uint32_t stride = d.contains(kMatrixStride) ? d.at(kMatrixStride) : 0;
                    end = std::max(end, d.at(kOffset) + bytes(t[i + 2], stride));
                }
                return end;
            }
            default:
                fail("a block holds a type of opcode {}", t[0]);
        }
    }
};

Module module_of(const std::vector<uint32_t>& words) {
    if (words.size() < 5 || words[0] != 0x07230203)
        fail("expected SPIR-V of this machine's byte order, found {} words", words.size());
    Module module;
    const auto text = [&](size_t word) { return reinterpret_cast<const char*>(&words[word]); };
    for (size_t i = 5; i < words.size();) {
        const uint32_t length = words[i] >> 16, op = words[i] & 0xffff;
        if (length == 0 || length > words.size() - i)
            fail("the instruction at word {} is cut off", i);
        const auto operand = [&](uint32_t n) { return n < length ? words[i + n] : 0; };
        if (op == kName)
            module.names[operand(1)] = text(i + 2);
        else if (op == kMemberName)
            module.member_names[{operand(1), operand(2)}] = text(i + 3);
        else if (op == kDecorate)
            module.decorations[operand(1)][operand(2)] = operand(3);
        else if (op == kMemberDecorate)
            module.member_decorations[{operand(1), operand(2)}][operand(3)] = operand(4);
        else if ((op >= kTypeBool && op <= kTypePointer) || op == kConstant || op == kVariable ||
                 (op >= kSpecConstantTrue && op <= kSpecConstant)) {
            std::vector<uint32_t> one(&words[i], &words[i] + length);
            one[0] = op;
            module.made[op <= kTypePointer ? one[1] : one[2]] = std::move(one);
        }
        i += length;
    }
    return module;
}

struct Slot {
    std::string type, name;
    uint32_t bytes = 0;
};

std::map<uint32_t, Slot> slots_of(const Module& module) {
    std::map<uint32_t, Slot> slots;
    for (const auto& [id, one] : module.made) {
        const auto decorated = module.decorations.find(id);
        if (one[0] != kVariable || decorated == module.decorations.end() ||
            !decorated->second.contains(kBinding))
            continue;
        const uint32_t type = module.made.at(one[1])[3], storage = one[3];
        const auto named = module.names.find(id);
        Slot slot{.type = {}, .name = named == module.names.end() ? "" : named->second};
        if (slot.name.empty()) // a block without a name of its own
            slot.name = module.names.at(type);
        if (storage == kStorageBuffer)
            slot.type = "STORAGE_BUFFER";
        else if (storage == kUniform && module.decorations.at(type).contains(kBlock))
            slot.type = "UNIFORM_BUFFER";
        else if (storage == kUniformConstant && module.op(type) == kTypeSampledImage)
            slot.type = "COMBINED_IMAGE_SAMPLER";
        else if (storage == kUniformConstant && module.op(type) == kTypeImage &&
                 module.made.at(type)[7] == 2)
            slot.type = "STORAGE_IMAGE";
        else
            fail("'{}' is no block, storage image or sampler with its image", slot.name);
        if (decorated->second.contains(kDescriptorSet) && decorated->second.at(kDescriptorSet) != 0)
            fail("'{}' is of set {}, expected set 0", slot.name,
                 decorated->second.at(kDescriptorSet));
        if (storage != kUniformConstant)
            slot.bytes = module.bytes(type);
        const uint32_t binding = decorated->second.at(kBinding);
        const auto [before, is_new] = slots.emplace(binding, slot);
        if (!is_new && before->second.type != slot.type)
            fail("binding {} is both '{}' and '{}'", binding, before->second.name, slot.name);
        before->second.bytes = std::max(before->second.bytes, slot.bytes);
    }
    return slots;
}

// "has_labels" of HAS_LABELS, "write_spans" of kWriteSpans.
std::string member_name(std::string name) {
    const auto is_lower = [](char c) { return c >= 'a' && c <= 'z'; };
    const auto is_upper = [](char c) { return c >= 'A' && c <= 'Z'; };
    if (name.size() > 1 && name[0] == 'k' && is_upper(name[1]))
        name.erase(0, 1);
    std::string out;
    for (size_t i = 0; i < name.size(); ++i) {
        if (i > 0 && is_upper(name[i]) && is_lower(name[i - 1]))
            out += '_';
        out += is_upper(name[i]) ? static_cast<char>(name[i] - 'A' + 'a') : name[i];
    }
    return out;
}

// "RayCast" of ray_cast.
std::string type_name(const std::string& id) {
    std::string out;
    for (size_t i = 0; i < id.size(); ++i)
        if (id[i] != '_')
            out += i == 0 || id[i - 1] == '_' ? static_cast<char>(std::toupper(id[i])) : id[i];
    return out;
}

struct Constant {
    std::string type, name;
    uint32_t bits = 0;
    std::string text() const {
        return type == "float"
                   ? fmt::format("std::bit_cast<float>({:#x})", bits)
                   : fmt::format("{}",
                                 static_cast<int64_t>(type == "int32_t" ? static_cast<int32_t>(bits)
                                                                        : int64_t{bits}));
    }
    friend bool operator==(const Constant&, const Constant&) = default;
};

void add_constants(const Module& module, std::map<uint32_t, Constant>& constants) {
    for (const auto& [id, one] : module.made) {
        const auto decorated = module.decorations.find(id);
        if (decorated == module.decorations.end() || !decorated->second.contains(kSpecId))
            continue;
        const std::vector<uint32_t>& type = module.made.at(one[1]);
        Constant constant{.type = "uint32_t",
                          .name = member_name(module.names.at(id)),
                          .bits = one[0] == kSpecConstant ? one[3] : one[0] == kSpecConstantTrue};
        if (type[0] != kTypeBool && type[2] != 32)
            fail("the constant {} has {} bits, expected 32", constant.name, type[2]);
        if (type[0] == kTypeFloat)
            constant.type = "float";
        else if (type[0] == kTypeInt && type[3] == 1)
            constant.type = "int32_t";
        const uint32_t number = decorated->second.at(kSpecId);
        const auto [before, is_new] = constants.emplace(number, constant);
        if (!is_new && before->second != constant)
            fail("constant_id {} is both {} and {}", number, before->second.name, constant.name);
    }
}

// C++ and the shader must agree on these: the structs of SPIR-V that a header declares.
void add_assertions(const Module& module, const std::set<std::string>& shared,
                    std::set<std::string>& out) {
    const auto shared_name = [&](uint32_t type) {
        const auto name = module.names.find(type);
        const auto d = module.decorations.find(type);
        const bool is_block = d != module.decorations.end() && d->second.contains(kBlock);
        return name != module.names.end() && !is_block && shared.contains(name->second)
                   ? name->second
                   : std::string();
    };
    for (const auto& [id, one] : module.made) {
        if (one[0] == kTypeArray || one[0] == kTypeRuntimeArray) {
            const std::string element = shared_name(one[2]);
            if (!element.empty() && module.decorations.contains(id))
                out.insert(fmt::format("sizeof({}) == {}", element,
                                       module.decorations.at(id).at(kArrayStride)));
        }
        if (one[0] != kTypeStruct || shared_name(id).empty())
            continue;
        for (uint32_t i = 0; i + 2 < one.size(); ++i) {
            const auto d = module.member_decorations.find({id, i});
            if (d != module.member_decorations.end() && d->second.contains(kOffset))
                out.insert(fmt::format("offsetof({}, {}) == {}", shared_name(id),
                                       module.member_names.at({id, i}), d->second.at(kOffset)));
        }
    }
}

std::string read(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        fail("{}: cannot be read", path);
    return {std::istreambuf_iterator<char>(file), {}};
}

void write(const std::string& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    if (!(file << text << std::flush))
        fail("{}: cannot be written", path);
}

// The headers (.h) that a shader includes, also by other files, and the structs they declare.
void add_headers(const std::string& root, const std::string& text, std::set<std::string>& headers,
                 std::set<std::string>& structs) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("#include \""))
            continue;
        const std::string name = line.substr(10, line.find('"', 10) - 10);
        const std::string included = read(root + "/" + name);
        if (name.ends_with(".h")) {
            if (!headers.insert(name).second)
                continue;
            for (size_t at = 0; (at = included.find("\nstruct ", at)) != std::string::npos;) {
                at += 8;
                structs.insert(included.substr(at, included.find(' ', at) - at));
            }
        }
        add_headers(root, included, headers, structs);
    }
}

void embed(const std::string& source, const std::string& root, const std::string& out,
           const std::string& id, const Strings& macros) {
    std::set<std::string> headers, structs, assertions;
    add_headers(root, read(source), headers, structs);
    std::string arrays, codes;
    std::map<uint32_t, Constant> constants;
    for (uint32_t variant = 0; variant < 1u << macros.size(); ++variant) {
        const std::string path = fmt::format("{}/{}_{}.spv", out, id, variant);
        const std::string bytes = read(path);
        std::vector<uint32_t> words(bytes.size() / 4);
        std::copy_n(bytes.data(), 4 * words.size(), reinterpret_cast<char*>(words.data()));
        std::map<uint32_t, Slot> slots;
        try {
            const Module module = module_of(words);
            slots = slots_of(module);
            add_constants(module, constants);
            add_assertions(module, structs, assertions);
        } catch (const std::exception& error) {
            fail("{}: {}", path, error.what());
        }
        arrays += fmt::format("constexpr uint32_t kWords{}[] = {{", variant);
        for (size_t i = 0; i < words.size(); ++i)
            arrays += fmt::format("{}{:#x},", i % 16 == 0 ? "\n" : "", words[i]);
        arrays += fmt::format("}};\nconstexpr std::array<BindingSlot, {}> kSlots{}{{{{",
                              slots.size(), variant);
        for (const auto& [binding, slot] : slots)
            arrays += fmt::format("\n    {{{}, VK_DESCRIPTOR_TYPE_{}, {}, \"{}\"}},", binding,
                                  slot.type, slot.bytes, slot.name);
        arrays += "}};\n";
        std::string name = id;
        for (size_t i = 0; i < macros.size(); ++i)
            if (variant >> i & 1)
                name += " " + member_name(macros[i]);
        codes += fmt::format("    {{\"{}\", kWords{}, kSlots{}, kConstants}},\n", name, variant,
                             variant);
    }
    std::string members, index = "0", values, defaults;
    for (size_t i = 0; i < macros.size(); ++i) {
        members += fmt::format("    bool {} = false;\n", member_name(macros[i]));
        index += fmt::format(" + {} * {}", 1u << i, member_name(macros[i]));
    }
    for (const auto& [number, constant] : constants) {
        members += fmt::format("    {} {} = {};\n", constant.type, constant.name, constant.text());
        values += fmt::format("std::bit_cast<uint32_t>({}), ", constant.name);
        defaults +=
            fmt::format("\n    {{{}, \"{}\", {:#x}}},", number, constant.name, constant.bits);
    }
    const std::string type = type_name(id),
                      note = fmt::format("// Generated from {} by embed_spirv.\n",
                                         std::filesystem::path(source).filename().string());
    write(fmt::format("{}/{}.h", out, id),
          note + fmt::format("#pragma once\n#include <bit>\n#include \"engine/gpu/shader.h\"\n"
                             "namespace palpate::spirv {{\nstruct {} {{\n{}"
                             "    operator Shader() const;\n}};\n}} // namespace palpate::spirv\n",
                             type, members));
    std::string text = note + fmt::format("#include \"{}.h\"\n#include <cstddef>\n", id);
    for (const std::string& header : headers)
        text += fmt::format("#include \"{}\"\n", header);
    text += "namespace palpate {\nnamespace {\n" + arrays +
            fmt::format(
                "constexpr std::array<ShaderConstant, {}> kConstants{{{{{}}}}};\n"
                "constexpr ShaderCode kCodes[] = {{\n{}}};\n}} // namespace\n"
                "spirv::{}::operator Shader() const {{ return {{&kCodes[{}], {{{}}}}}; }}\n"
                "}} // namespace palpate\n",
                constants.size(), defaults, codes, type, index, values);
    if (!assertions.empty()) {
        text += "namespace palpate::gpu {\n";
        for (const std::string& assertion : assertions)
            text += fmt::format("static_assert({}, \"as in {}\");\n", assertion, id);
        text += "} // namespace palpate::gpu\n";
    }
    write(fmt::format("{}/{}.cpp", out, id), text);
}

} // namespace

int main(int argc, char** argv) try {
    if (argc < 5)
        fail("expected SHADER ROOT OUT ID [MACRO ...]");
    embed(argv[1], argv[2], argv[3], argv[4], Strings(argv + 5, argv + argc));
    return 0;
} catch (const std::exception& error) {
    fmt::print(stderr, "embed_spirv: {}\n", error.what());
    return 1;
}
