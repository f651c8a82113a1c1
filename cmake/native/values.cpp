#include <algorithm>

#include "translator.h"

namespace translator {

const char* cpp_type(char kind, bool uniform) {
    switch (kind) {
        case 'f':
            return uniform ? "float" : "F";
        case 'u':
            return uniform ? "uint32_t" : "U";
        default:
            return uniform ? "bool" : "B";
    }
}

Part Translator::literal(char kind, uint32_t bits) const {
    return {kind == 'f'   ? fmt::format("as_float({:#x}u)", bits)
            : kind == 'u' ? fmt::format("{}u", bits)
                          : std::string(bits ? "true" : "false"),
            kind, true, -1};
}

void Translator::constants() {
    for (const uint32_t id : module_.order) {
        const Instruction& one = module_.at(id);
        types_[id] = one.type;
        const auto spec = [&](uint32_t bits) {
            if (module_.is_wide(one.type))
                fail("a specialisation constant of 64 bits");
            const char kind = module_.scalars(one.type)[0];
            if (!module_.is_decorated(id, kSpecId)) {
                values_[id] = {literal(kind, bits)};
                return;
            }
            const std::string value = fmt::format("launch.constants[{}]", constants_.size());
            constants_.emplace_back(module_.decoration(id, kSpecId), bits);
            setup_ += fmt::format("const {} c{} = {};\n", cpp_type(kind, true), id,
                                  kind == 'f'   ? "as_float(" + value + ")"
                                  : kind == 'b' ? value + " != 0"
                                                : value);
            values_[id] = {{fmt::format("c{}", id), kind, true, -1}};
        };
        switch (one.op) {
            case kConstantTrue:
            case kConstantFalse:
                values_[id] = {literal('b', one.op == kConstantTrue)};
                break;
            case kConstant:
                for (size_t i = 0; i < one.in.size(); ++i)
                    values_[id].push_back(literal(module_.scalars(one.type)[i], one.in[i]));
                break;
            case kConstantNull:
            case kUndef:
                for (const char kind : module_.scalars(one.type))
                    values_[id].push_back(literal(kind, 0));
                break;
            case kConstantComposite:
            case kSpecConstantComposite:
                for (const uint32_t part : one.in)
                    for (const Part& scalar : values_.at(part))
                        values_[id].push_back(scalar);
                break;
            case kSpecConstant:
                spec(one.in[0]);
                break;
            case kSpecConstantTrue:
            case kSpecConstantFalse:
                spec(one.op == kSpecConstantTrue);
                break;
            case kSpecConstantOp: {
                Instruction inner = one;
                inner.op = one.in[0];
                inner.in.erase(inner.in.begin());
                instruction(inner);
                break;
            }
            default:
                break;
        }
    }
    setup_ += scopes_[0].text; // of OpSpecConstantOp
    scopes_[0].text.clear();
}

// Bound blocks and images, by rising binding, and shared memory.
void Translator::resources() {
    std::map<uint32_t, const char*> kinds;
    std::vector<std::pair<uint32_t, uint32_t>> bound; // binding and variable
    for (const uint32_t id : module_.order) {
        const Instruction& one = module_.at(id);
        if (one.op != kVariable)
            continue;
        const uint32_t type = module_.at(one.type).in[1], storage = one.in[0];
        if (storage == kWorkgroup) {
            const uint32_t words = module_.block_words(type);
            setup_ += fmt::format("alignas(64) uint32_t f{}[{}];\nconst Memory b{}{{f{}, {}}};\n",
                                  id, words, id, id, words);
        } else if (storage == kPushConstant) {
            setup_ += fmt::format(
                "const auto* f{} = reinterpret_cast<const uint32_t*>("
                "launch.push_constants.data());\n",
                id);
        } else if (module_.is_decorated(id, kBinding)) {
            if (module_.decoration(id, kDescriptorSet) != 0)
                fail("a binding of set {}, expected set 0", module_.decoration(id, kDescriptorSet));
            const uint32_t binding = module_.decoration(id, kBinding);
            kinds[binding] = storage == kStorageBuffer               ? "STORAGE_BUFFER"
                             : storage == kUniform                   ? "UNIFORM_BUFFER"
                             : module_.op(type) == kTypeSampledImage ? "COMBINED_IMAGE_SAMPLER"
                                                                     : "STORAGE_IMAGE";
            bound.emplace_back(binding, id);
        }
    }
    bindings_.assign(kinds.begin(), kinds.end());
    for (const auto& [binding, id] : bound) {
        const auto at = std::distance(kinds.begin(), kinds.find(binding));
        if (std::string(kinds[binding]).ends_with("BUFFER")) {
            const uint32_t words = module_.block_words(module_.at(module_.at(id).type).in[1]);
            setup_ += fmt::format(
                "const Memory b{0} = memory_of(launch.resources[{1}]);\n"
                "const uint32_t* const f{0} = fixed_part(b{0}, {2});\n",
                id, at, words);
        } else {
            images_[id] = id;
            setup_ +=
                fmt::format("const Texture x{} = texture_of(launch.resources[{}]);\n", id, at);
        }
    }
}

// Built-in variables: of the group they are uniform.
void Translator::inputs() {
    uint32_t size[3];
    for (int axis = 0; axis < 3; ++axis)
        size[axis] = module_.has_group_ids ? module_.constant(module_.group_size[axis])
                                           : module_.group_size[axis];
    const auto one_of = [&](const std::string& name) {
        variables_.push_back({name, 0, {}});
        return Part{name, 'u', false, static_cast<int>(variables_.size()) - 1};
    };
    Parts group, local, global;
    for (int axis = 0; axis < 3; ++axis) {
        group.push_back({fmt::format("group{}", axis), 'u', true, -1});
        local.push_back(size[axis] == 1 ? literal('u', 0) : one_of(fmt::format("local{}", axis)));
        global.push_back(size[axis] == 1 ? group.back() : one_of(fmt::format("global{}", axis)));
    }
    for (const uint32_t id : module_.order) {
        const Instruction& one = module_.at(id);
        if (one.op != kVariable || one.in[0] != kInput)
            continue;
        switch (const uint32_t built_in = module_.decoration(id, kBuiltIn)) {
            case kNumWorkgroups:
                for (int axis = 0; axis < 3; ++axis)
                    values_[id].push_back({fmt::format("launch.groups[{}]", axis), 'u', true, -1});
                break;
            case kWorkgroupId:
                values_[id] = group;
                break;
            case kLocalInvocationId:
                values_[id] = local;
                break;
            case kGlobalInvocationId:
                values_[id] = global;
                break;
            case kLocalInvocationIndex:
                values_[id] = {one_of("index")};
                break;
            case kSubgroupSize:
                values_[id] = {literal('u', 8)};
                break;
            default:
                fail("the built-in variable {} is not known", built_in);
        }
    }
}

Part Translator::resolve(const Part& part) {
    if (part.variable < 0)
        return part;
    const Variable& variable = variables_[static_cast<size_t>(part.variable)];
    Part out = part;
    size_t common = 0;
    while (common < variable.loops.size() && common < loops_.size() &&
           variable.loops[common] == loops_[common])
        ++common;
    for (size_t i = common; i < variable.loops.size(); ++i)
        if (facts_.diverging.contains(variable.loops[i])) {
            next_.leaving.insert(variable.name);
            return {variable.name + "_out", part.kind, false, -1};
        }
    return out;
}

Parts Translator::parts(uint32_t id) {
    const auto found = values_.find(id);
    if (found == values_.end())
        fail("%{} is read before it is written", id);
    Parts all;
    for (const Part& part : found->second)
        all.push_back(resolve(part));
    return all;
}

std::string Translator::text(const Part& part) {
    if (part.text.ends_with("_out"))
        next_.used.insert(part.text.substr(0, part.text.size() - 4));
    if (part.variable < 0)
        return part.text;
    const Variable& variable = variables_[static_cast<size_t>(part.variable)];
    next_.used.insert(variable.name);
    // The scope around both the definition and this place declares the variable.
    const auto inside = [&](size_t scope, int outer) {
        for (int at = static_cast<int>(scope); at >= 0;
             at = scopes_[static_cast<size_t>(at)].parent)
            if (at == outer)
                return true;
        return false;
    };
    int outer = variable.scope;
    while (!inside(scope_, outer))
        outer = scopes_[static_cast<size_t>(outer)].parent;
    if (outer != variable.scope) {
        const Scope& scope = scopes_[static_cast<size_t>(outer)];
        const std::pair to(scope.depth, scope.key);
        const auto [known, is_new] = next_.hoisted.emplace(variable.name, to);
        if (!is_new && scope.depth < known->second.first)
            known->second = to;
    }
    return part.text;
}

std::string Translator::lanes(const Part& part) {
    return part.uniform ? fmt::format("{}({})", cpp_type(part.kind, false), text(part))
                        : text(part);
}

bool Translator::is_wanted(const std::string& name) const {
    return first_pass_ || facts_.used.contains(name);
}

Part Translator::define(const std::string& name, char kind, bool uniform, const std::string& value,
                        bool has_effect) {
    variables_.push_back({name, static_cast<int>(scope_), loops_});
    const Part part{name, kind, uniform, static_cast<int>(variables_.size()) - 1};
    if (!has_effect && !is_wanted(name))
        return part;
    const char* type = cpp_type(kind, uniform);
    if (facts_.hoisted.contains(name))
        line(fmt::format("{} = {};", name, value));
    else
        line(fmt::format("const {} {} = {};", type, name, value));
    declare(part);
    if (facts_.leaving.contains(name))
        keep(part);
    return part;
}

// A value that is read elsewhere is declared there, and one that is read behind a loop that lanes
// leave one by one is kept as each lane last had it.
void Translator::declare(const Part& part) {
    if (const auto found = facts_.hoisted.find(part.text); found != facts_.hoisted.end())
        for (Scope& scope : scopes_)
            if (scope.key == found->second.second)
                scope.text.insert(
                    0, fmt::format("{} {}{{}};\n", cpp_type(part.kind, part.uniform), part.text));
}

void Translator::keep(const Part& part) {
    const char* type = cpp_type(part.kind, false);
    scopes_[1].text.insert(0, fmt::format("{} {}_out{{}};\n", type, part.text));
    line(fmt::format("{0}_out = select({1}, {2}, {0}_out);", part.text, mask(),
                     part.uniform ? fmt::format("{}({})", type, part.text) : part.text));
}

} // namespace translator
