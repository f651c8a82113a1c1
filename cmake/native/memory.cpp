#include "translator.h"

namespace translator {

namespace {

bool is_local(uint32_t storage) {
    return storage == kPrivate || storage == kFunctionClass;
}

std::string plus(const std::string& a, uint32_t b) {
    return b == 0 ? a : fmt::format("{} + {}u", a, b);
}

} // namespace

// A lane's own array that holds constants and nothing else.
bool Translator::is_table(uint32_t variable) const {
    const Instruction& one = module_.at(variable);
    std::set<uint32_t> pointers{variable};
    uint32_t stores = one.in.size() > 1;
    for (const auto& [id, block] : module_.blocks)
        for (const Instruction& inner : block.body) {
            if (inner.op == kAccessChain && inner.in[0] == variable)
                pointers.insert(inner.id);
            if (inner.op != kStore || !pointers.contains(inner.in[0]))
                continue;
            const bool whole = inner.in[0] == variable && module_.made.contains(inner.in[1]) &&
                               module_.op(inner.in[1]) == kConstantComposite;
            stores += whole ? 1 : 2;
        }
    return stores == 1;
}

Pointer Translator::pointer(uint32_t id) {
    if (const auto found = pointers_.find(id); found != pointers_.end())
        return found->second;
    const Instruction& one = module_.at(id);
    if (one.op != kVariable)
        fail("%{} is no pointer that is known", id);
    return {.base = id, .type = module_.at(one.type).in[1]};
}

void Translator::access_chain(const Instruction& one) {
    Pointer at = pointer(one.in[0]);
    const bool local = is_local(module_.at(at.base).in[0]);
    Parts terms;
    if (!at.is_known)
        terms.push_back(resolve(at.index));
    for (size_t i = 1; i < one.in.size(); ++i) {
        const Instruction& type = module_.at(at.type);
        const bool is_constant =
            module_.made.contains(one.in[i]) && module_.op(one.in[i]) == kConstant;
        uint32_t stride = 1;
        if (type.op == kTypeStruct) {
            const uint32_t member = module_.constant(one.in[i]);
            at.word +=
                local ? module_.part_first(at.type, member) : module_.member_word(at.type, member);
            at.matrix_stride = module_.member_matrix_stride(at.type, member);
            at.type = type.in[member];
            continue;
        }
        if (type.op == kTypeArray || type.op == kTypeRuntimeArray)
            stride = local ? static_cast<uint32_t>(module_.scalars(type.in[0]).size())
                           : module_.stride_words(at.type);
        else if (type.op == kTypeMatrix)
            stride = at.matrix_stride != 0 ? at.matrix_stride / 4 : module_.at(type.in[0]).in[1];
        at.type = type.in[0];
        if (is_constant) {
            at.word += stride * module_.constant(one.in[i]);
            continue;
        }
        const Part index = parts(one.in[i])[0];
        terms.push_back(stride == 1 ? index
                                    : operation(fmt::format("v{}_{}", one.id, i),
                                                fmt::format("{{0}} * {{1}}"), 'u',
                                                {index, literal('u', stride)}));
    }
    for (size_t i = 1; i < terms.size(); ++i)
        terms[0] =
            operation(fmt::format("v{}_s{}", one.id, i), "{0} + {1}", 'u', {terms[0], terms[i]});
    at.is_known = terms.empty();
    if (!at.is_known)
        at.index = terms[0];
    pointers_[one.id] = at;
}

// In words of the memory; a lane's own array is kept lane by lane.
std::string Translator::address(const Pointer& at, uint32_t word) {
    if (at.is_known)
        return fmt::format("{}u", word);
    const Part index = resolve(at.index);
    return index.uniform
               ? plus(text(index), word)
               : (word == 0 ? text(index) : fmt::format("{} + U({}u)", text(index), word));
}

Parts Translator::load(const Pointer& from, const std::string& name) {
    const Instruction& base = module_.at(from.base);
    const std::string kinds = module_.scalars(from.type);
    const uint32_t storage = base.in[0];
    const bool local = is_local(storage), table = local && is_table(from.base);
    Words words;
    if (local)
        for (uint32_t i = 0; i < kinds.size(); ++i)
            words.push_back(from.word + i);
    else
        module_.offsets(from.type, from.word, from.matrix_stride, words);
    const uint32_t fixed =
        storage == kPushConstant ? ~0u : module_.block_words(module_.at(base.type).in[1]);
    Parts out;
    if (module_.is_wide(from.type) &&
        storage == kStorageBuffer) // in one piece: others may write it
        return wide_atomic("kLoad", from, {literal('u', 0), literal('u', 0)}, name);
    for (size_t i = 0; i < kinds.size(); ++i) {
        const std::string part = fmt::format("{}_{}", name, i);
        const bool uniform = (from.is_known || resolve(from.index).uniform) && (!local || table);
        std::string value;
        if (is_wanted(part)) {
            const std::string at = address(from, words[i]);
            if (local && !table && from.is_known)
                value = fmt::format("l{}[{}]", from.base, words[i]);
            else if (local && !table)
                value = fmt::format("load(own_memory(l{0}), own_address({1}{2}))", from.base,
                                    resolve(from.index).uniform ? "U" : "", "(" + at + ")");
            else if (from.is_known && words[i] < fixed)
                value = fmt::format("f{}[{}]", from.base, words[i]);
            else
                value = fmt::format("load(b{}, {})", from.base, at);
            if (kinds[i] == 'f')
                value = fmt::format("as_float({})", value);
            else if (kinds[i] == 'b')
                value = fmt::format("ine({}, {}(0u))", value, cpp_type('u', uniform));
        }
        out.push_back(define(part, kinds[i], uniform, value));
    }
    return out;
}

void Translator::store(const Pointer& to, const Parts& values) {
    const Instruction& base = module_.at(to.base);
    const bool local = is_local(base.in[0]);
    if (local && is_table(to.base))
        return;
    Words words;
    if (local)
        for (uint32_t i = 0; i < values.size(); ++i)
            words.push_back(to.word + i);
    else
        module_.offsets(to.type, to.word, to.matrix_stride, words);
    for (size_t i = 0; i < values.size(); ++i) {
        const Part& value = values[i];
        const bool uniform_place = to.is_known || resolve(to.index).uniform;
        const std::string at = address(to, words[i]);
        const auto as_word = [&](const std::string& x) {
            return value.kind == 'u' ? x : fmt::format("as_uint({})", x);
        };
        if (local && to.is_known)
            line(fmt::format("l{0}[{1}] = select({2}, {3}, l{0}[{1}]);", to.base, words[i], mask(),
                             as_word(lanes(value))));
        else if (local)
            line(fmt::format("store(own_memory(l{}), own_address({}({})), {}, {});", to.base,
                             uniform_place ? "U" : "", at, as_word(lanes(value)), mask()));
        else if (uniform_place && value.uniform)
            line(fmt::format("store(b{}, {}, {});", to.base, at, as_word(text(value))));
        else if (uniform_place)
            line(fmt::format("store(b{}, {}, lane_of({}, first_lane({})));", to.base, at,
                             as_word(text(value)), mask()));
        else
            line(
                fmt::format("store(b{}, {}, {}, {});", to.base, at, as_word(lanes(value)), mask()));
    }
}

// An integer of 64 bits at once; one a lane. The name is that of its two parts.
Parts Translator::wide_atomic(const std::string& kind, const Pointer& at, const Parts& value,
                              const std::string& name) {
    const bool uniform = at.is_known || resolve(at.index).uniform;
    line(fmt::format("const auto w{} = atomic<Atomic::{}>(b{}, {}({}), Wide{{{}, {}}}, {});", name,
                     kind, at.base, uniform ? "U" : "", address(at, at.word), lanes(value[0]),
                     lanes(value[1]), mask()));
    return {define(name + "_0", 'u', false, fmt::format("w{}.low", name)),
            define(name + "_1", 'u', false, fmt::format("w{}.high", name))};
}

void Translator::atomic(const Instruction& one) {
    const char* kind = one.op == kAtomicLoad       ? "kLoad"
                       : one.op == kAtomicStore    ? "kStore"
                       : one.op == kAtomicExchange ? "kExchange"
                       : one.op == kAtomicIAdd     ? "kAdd"
                       : one.op == kAtomicUMin     ? "kUmin"
                       : one.op == kAtomicUMax     ? "kUmax"
                       : one.op == kAtomicSMin     ? "kSmin"
                       : one.op == kAtomicSMax     ? "kSmax"
                       : one.op == kAtomicAnd      ? "kAnd"
                       : one.op == kAtomicOr       ? "kOr"
                       : one.op == kAtomicXor      ? "kXor"
                                                   : nullptr;
    if (!kind)
        fail("{} is not translated", name_of(one.op));
    const Pointer at = pointer(one.in[0]);
    const std::string place = address(at, at.word);
    const bool uniform = at.is_known || resolve(at.index).uniform;
    if (module_.is_wide(at.type)) {
        if (one.op != kAtomicUMin)
            fail("{} of 64 bits is not translated", name_of(one.op));
        values_[one.id] = wide_atomic(kind, at, parts(one.in[3]), fmt::format("v{}", one.id));
        return;
    }
    const Part value = one.op == kAtomicLoad ? literal('u', 0) : parts(one.in[3])[0];
    const std::string call = fmt::format("atomic<Atomic::{}>(b{}, {}({}), {}, {})", kind, at.base,
                                         uniform ? "U" : "", place, lanes(value), mask());
    if (one.op == kAtomicStore)
        line(call + ";");
    else
        values_[one.id] = {define(fmt::format("v{}_0", one.id), 'u', false, call, true)};
}

} // namespace translator
