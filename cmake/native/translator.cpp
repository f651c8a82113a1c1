#include "translator.h"

#include <algorithm>

namespace translator {

Translator::Translator(const Module& module, std::vector<Served> served, uint32_t vectors)
    : module_(module), served_(std::move(served)), vectors_(vectors) {}

// Arrays of each lane's own, and tables of constants.
void Translator::own_arrays() {
    for (const uint32_t id : module_.order) {
        const Instruction& one = module_.at(id);
        if (one.op != kVariable || (one.in[0] != kPrivate && one.in[0] != kFunctionClass))
            continue;
        const std::string kinds = module_.scalars(module_.at(one.type).in[1]);
        uint32_t content = one.in.size() > 1 ? one.in[1] : 0;
        const bool table = is_table(id);
        for (const auto& [number, block] : module_.blocks)
            for (const Instruction& inner : block.body)
                if (table && inner.op == kStore && inner.in[0] == id)
                    content = inner.in[1];
        std::vector<std::string> words;
        if (content != 0)
            for (const Part& part : values_.at(content))
                words.push_back(part.kind == 'u' ? part.text
                                                 : fmt::format("as_uint({})", part.text));
        if (table) {
            setup_ += fmt::format(
                "static constexpr uint32_t f{}[] = {{{}}};\n"
                "const Memory b{}{{const_cast<uint32_t*>(f{}), {}}};\n",
                id, fmt::join(words, ", "), id, id, kinds.size());
            continue;
        }
        line(fmt::format("U l{}[{}];", id, kinds.size()));
        for (size_t i = 0; i < words.size(); ++i)
            line(fmt::format("l{}[{}] = U({});", id, i, words[i]));
    }
}

std::string Translator::run() {
    for (int pass = 0;; ++pass) {
        if (pass == 100)
            fail("what differs between lanes is not settled after {} passes", pass);
        Translator again(module_, served_, vectors_);
        again.facts_ = again.next_ = next_;
        again.next_.used.clear();
        again.first_pass_ = pass == 0;
        again.pass();
        if (pass > 0 && again.next_ == again.facts_)
            return again.file();
        next_ = again.next_;
    }
}

void Translator::pass() {
    scopes_ = {{-1, 0, "setup", ""}, {0, 1, "body", ""}};
    constants();
    scope_ = 1;
    resources();
    inputs();
    own_arrays();
    masks_ = {"all"};
    block(module_.first_block, 0);
}

// The lines by which the driver knows a kernel.
std::string Translator::kernel(const Served& served, const uint32_t (&group_size)[3]) const {
    std::string bindings, constants;
    for (const auto& [binding, type] : bindings_)
        bindings += fmt::format("{{0, {}, VK_DESCRIPTOR_TYPE_{}, {}}}, ", binding, type,
                                served.bindings.contains(binding));
    for (const auto& [id, bits] : constants_)
        constants +=
            fmt::format("{{{}, {}u}}, ", id,
                        id < kFirstFolded ? bits : served.number >> (id - kFirstFolded) & 1u);
    std::string out;
    if (!bindings.empty())
        out += fmt::format("static constexpr Binding {}_bindings[] = {{{}}};\n", served.name,
                           bindings);
    if (!constants.empty())
        out += fmt::format("static constexpr Constant {}_constants[] = {{{}}};\n", served.name,
                           constants);
    return out + fmt::format(
                     "extern const Kernel {0};\n"
                     "const Kernel {0}{{{1:#x}u, \"{0}\", {{{2}, {3}, {4}}}, {5}, {6}, run}};\n",
                     served.name, served.hash, group_size[0], group_size[1], group_size[2],
                     bindings.empty() ? "{}" : served.name + "_bindings",
                     constants.empty() ? "{}" : served.name + "_constants");
}

std::string Translator::file() const {
    uint32_t size[3], total = 1;
    for (int axis = 0; axis < 3; ++axis) {
        size[axis] = module_.has_group_ids ? module_.constant(module_.group_size[axis])
                                           : module_.group_size[axis];
        total *= size[axis];
    }
    if (module_.has_barrier && total % 16 != 0)
        fail("a group of {} invocations with barriers, expected a multiple of 16", total);
    std::string lanes = fmt::format("#define PALPATE_LANES {}\n", module_.has_barrier ? total : 0);
    if (!module_.has_barrier && vectors_ > 1)
        lanes = fmt::format(
            "#if defined(__AVX512F__)\n#define PALPATE_LANES {}\n#else\n"
            "#define PALPATE_LANES {}\n#endif\n",
            16 * vectors_, 8 * vectors_);
    std::string out = fmt::format(
        "// Made from {} by translate_spirv.\n{}"
        "#include \"engine/native/lanes.h\"\n{}namespace palpate::native {{\nnamespace {{\n"
        "void run(const Launch& launch, uint64_t first, uint64_t count) {{\n{}"
        "for (uint64_t number = first; number < first + count; ++number) {{\n"
        "const uint64_t rows = number / launch.groups[0];\n"
        "const uint32_t group0 = launch.first_group[0] + "
        "static_cast<uint32_t>(number % launch.groups[0]);\n"
        "const uint32_t group1 = launch.first_group[1] + "
        "static_cast<uint32_t>(rows % launch.groups[1]);\n"
        "const uint32_t group2 = launch.first_group[2] + "
        "static_cast<uint32_t>(rows / launch.groups[1]);\n",
        served_.front().name, lanes,
        module_.has_wide() ? "#include \"engine/native/lanes_wide.h\"\n" : "", setup_);
    out += fmt::format(
        "for (uint32_t base = 0; base < {}; base += kLanes) {{\n"
        "const U index = lane_numbers() + U(base);\nconst B all{};\n",
        total,
        total % 64 == 0 ? std::string("(true)") : fmt::format(" = ult(index, U({}u))", total));
    out += fmt::format(
        "const U local0 = umod(index, U({0}u));\n"
        "const U local1 = umod(udiv(index, U({0}u)), U({1}u));\n"
        "const U local2 = udiv(index, U({2}u));\n",
        size[0], size[1], size[0] * size[1]);
    for (int axis = 0; axis < 3; ++axis)
        out +=
            fmt::format("const U global{0} = U(group{0} * {1}u) + local{0};\n", axis, size[axis]);
    out += scopes_[1].text + "}\n}\n}\n";
    out += "} // namespace\nnamespace PALPATE_LEVEL {\n";
    for (const Served& served : served_)
        out += kernel(served, size);
    return out + "}\n}\n";
}

} // namespace translator
