#include <algorithm>

#include "translator.h"

namespace translator {

namespace {

// An operation on each scalar of its operands: what it is written as, and the kind of its result.
struct Elementwise {
    const char* text;
    char kind; // '=' : of its last operand
};

const std::map<uint32_t, Elementwise>& elementwise_operations() {
    static const std::map<uint32_t, Elementwise> all{
        {kConvertFToU, {"to_uint({0})", 'u'}},
        {kConvertFToS, {"to_int({0})", 'u'}},
        {kConvertSToF, {"from_int({0})", 'f'}},
        {kConvertUToF, {"from_uint({0})", 'f'}},
        {kSNegate, {"~{0} + {T}(1u)", 'u'}},
        {kFNegate, {"-{0}", 'f'}},
        {kIAdd, {"{0} + {1}", 'u'}},
        {kFAdd, {"{0} + {1}", 'f'}},
        {kISub, {"{0} - {1}", 'u'}},
        {kFSub, {"{0} - {1}", 'f'}},
        {kIMul, {"{0} * {1}", 'u'}},
        {kFMul, {"{0} * {1}", 'f'}},
        {kUDiv, {"udiv({0}, {1})", 'u'}},
        {kSDiv, {"sdiv({0}, {1})", 'u'}},
        {kFDiv, {"{0} / {1}", 'f'}},
        {kUMod, {"umod({0}, {1})", 'u'}},
        {kSRem, {"srem({0}, {1})", 'u'}},
        {kSMod, {"smod({0}, {1})", 'u'}},
        {kFMod, {"{0} - {1} * ffloor({0} / {1})", 'f'}},
        {kIsNan, {"fne({0}, {0})", 'b'}},
        {kIsInf, {"feq(fabs({0}), {T}(__builtin_inff()))", 'b'}},
        {kLogicalEqual, {"lnot(lxor({0}, {1}))", 'b'}},
        {kLogicalNotEqual, {"lxor({0}, {1})", 'b'}},
        {kLogicalOr, {"lor({0}, {1})", 'b'}},
        {kLogicalAnd, {"land({0}, {1})", 'b'}},
        {kLogicalNot, {"lnot({0})", 'b'}},
        {kSelect, {"select({0}, {1}, {2})", '='}},
        {kIEqual, {"ieq({0}, {1})", 'b'}},
        {kINotEqual, {"ine({0}, {1})", 'b'}},
        {kUGreaterThan, {"ult({1}, {0})", 'b'}},
        {kSGreaterThan, {"slt({1}, {0})", 'b'}},
        {kUGreaterThanEqual, {"ule({1}, {0})", 'b'}},
        {kSGreaterThanEqual, {"sle({1}, {0})", 'b'}},
        {kULessThan, {"ult({0}, {1})", 'b'}},
        {kSLessThan, {"slt({0}, {1})", 'b'}},
        {kULessThanEqual, {"ule({0}, {1})", 'b'}},
        {kSLessThanEqual, {"sle({0}, {1})", 'b'}},
        {kFOrdEqual, {"feq({0}, {1})", 'b'}},
        {kFUnordEqual, {"lnot(lor(flt({0}, {1}), flt({1}, {0})))", 'b'}},
        {kFOrdNotEqual, {"lor(flt({0}, {1}), flt({1}, {0}))", 'b'}},
        {kFUnordNotEqual, {"fne({0}, {1})", 'b'}},
        {kFOrdLessThan, {"flt({0}, {1})", 'b'}},
        {kFOrdGreaterThan, {"flt({1}, {0})", 'b'}},
        {kFOrdLessThanEqual, {"fle({0}, {1})", 'b'}},
        {kFOrdGreaterThanEqual, {"fle({1}, {0})", 'b'}},
        {kFUnordLessThan, {"lnot(fle({1}, {0}))", 'b'}},
        {kFUnordGreaterThan, {"lnot(fle({0}, {1}))", 'b'}},
        {kFUnordLessThanEqual, {"lnot(flt({1}, {0}))", 'b'}},
        {kFUnordGreaterThanEqual, {"lnot(flt({0}, {1}))", 'b'}},
        {kShiftRightLogical, {"shr({0}, {1})", 'u'}},
        {kShiftRightArithmetic, {"sar({0}, {1})", 'u'}},
        {kShiftLeftLogical, {"shl({0}, {1})", 'u'}},
        {kBitwiseOr, {"{0} | {1}", 'u'}},
        {kBitwiseXor, {"{0} ^ {1}", 'u'}},
        {kBitwiseAnd, {"{0} & {1}", 'u'}},
        {kNot, {"~{0}", 'u'}},
        {kBitCount, {"bit_count({0})", 'u'}},
    };
    return all;
}

// GLSL.std.450, by number.
const std::map<uint32_t, Elementwise>& extended_operations() {
    static const std::map<uint32_t, Elementwise> all{
        {3, {"select(flt({0}, {T}(0.0f)), fceil({0}), ffloor({0}))", 'f'}}, // Trunc
        {4, {"fabs({0})", 'f'}},
        {5, {"smax({0}, ~{0} + {T}(1u))", 'u'}}, // SAbs
        {6, {"fsign({0})", 'f'}},
        {8, {"ffloor({0})", 'f'}},
        {9, {"fceil({0})", 'f'}},
        {10, {"ffract({0})", 'f'}},
        {26, {"fpow({0}, {1})", 'f'}},
        {27, {"fexp({0})", 'f'}},
        {28, {"flog({0})", 'f'}},
        {29, {"fexp2({0})", 'f'}},
        {30, {"flog2({0})", 'f'}},
        {31, {"fsqrt({0})", 'f'}},
        {32, {"{T}(1.0f) / fsqrt({0})", 'f'}},
        {37, {"fmin({0}, {1})", 'f'}},
        {38, {"umin({0}, {1})", 'u'}},
        {39, {"smin({0}, {1})", 'u'}},
        {40, {"fmax({0}, {1})", 'f'}},
        {41, {"umax({0}, {1})", 'u'}},
        {42, {"smax({0}, {1})", 'u'}},
        {43, {"fclamp({0}, {1}, {2})", 'f'}},
        {44, {"umin(umax({0}, {1}), {2})", 'u'}},
        {45, {"smin(smax({0}, {1}), {2})", 'u'}},
        {46, {"fmix({0}, {1}, {2})", 'f'}},
        {48, {"fstep({0}, {1})", 'f'}},
        {50, {"ffma({0}, {1}, {2})", 'f'}},
        {73, {"lowest_bit({0})", 'u'}},
    };
    return all;
}

std::string filled(std::string text, const std::string& type, const std::vector<std::string>& in) {
    const auto replace = [&](const std::string& what, const std::string& by) {
        for (size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
            text.replace(at, what.size(), by);
    };
    replace("{T}", type);
    for (size_t i = 0; i < in.size(); ++i)
        replace(fmt::format("{{{}}}", i), in[i]);
    return text;
}

} // namespace

// Uniform where all operands are; else all of them are one a lane.
Part Translator::operation(const std::string& name, const std::string& format, char kind,
                           const Parts& operands) {
    const bool uniform =
        std::all_of(operands.begin(), operands.end(), [](const Part& p) { return p.uniform; });
    if (!is_wanted(name))
        return define(name, kind, uniform, "");
    std::vector<std::string> in;
    for (const Part& operand : operands)
        in.push_back(uniform ? text(operand) : lanes(operand));
    const char first = operands.empty() ? kind : operands.back().kind;
    return define(name, kind, uniform, filled(format, cpp_type(first, uniform), in));
}

// Integers of 64 bits, which are two numbers: comparisons are all that shaders need so far.
void Translator::wide(uint32_t id, uint32_t op, const Parts& a, const Parts& b) {
    const char* format = op == kIEqual      ? "land(ieq({0}, {2}), ieq({1}, {3}))"
                         : op == kINotEqual ? "lor(ine({0}, {2}), ine({1}, {3}))"
                         : op == kULessThan || op == kUGreaterThan
                             ? "lor(ult({1}, {3}), land(ieq({1}, {3}), ult({0}, {2})))"
                             : nullptr;
    if (!format || a.size() != 2 || b.size() != 2)
        fail("{} of 64 bits is not translated", name_of(op));
    const Parts in =
        op == kUGreaterThan ? Parts{b[0], b[1], a[0], a[1]} : Parts{a[0], a[1], b[0], b[1]};
    values_[id] = {operation(fmt::format("v{}_0", id), format, 'b', in)};
}

bool Translator::elementwise(const Instruction& one) {
    const auto found = elementwise_operations().find(one.op);
    if (found == elementwise_operations().end())
        return false;
    const auto is_wide = [&](uint32_t id) { return module_.is_wide(types_.at(id)); };
    if (one.op != kSelect &&
        (module_.is_wide(one.type) || std::any_of(one.in.begin(), one.in.end(), is_wide))) {
        wide(one.id, one.op, parts(one.in[0]), parts(one.in.back()));
        return true;
    }
    std::vector<Parts> operands;
    size_t count = 0;
    for (const uint32_t id : one.in) {
        operands.push_back(parts(id));
        count = std::max(count, operands.back().size());
    }
    Parts out;
    for (size_t i = 0; i < count; ++i) {
        Parts in;
        for (const Parts& operand : operands) // one condition may choose between vectors
            in.push_back(operand.size() == 1 ? operand[0] : operand[i]);
        const char kind = found->second.kind == '=' ? in.back().kind : found->second.kind;
        out.push_back(operation(fmt::format("v{}_{}", one.id, i), found->second.text, kind, in));
    }
    values_[one.id] = out;
    return true;
}

Part Translator::dot(const std::string& name, const Parts& a, const Parts& b) {
    Parts in = a;
    in.insert(in.end(), b.begin(), b.end());
    std::string sum = fmt::format("{{0}} * {{{}}}", a.size());
    for (size_t i = 1; i < a.size(); ++i)
        sum += fmt::format(" + {{{}}} * {{{}}}", i, a.size() + i);
    return operation(name, sum, 'f', in);
}

bool Translator::algebra(const Instruction& one) {
    const auto name = [&](size_t i) { return fmt::format("v{}_{}", one.id, i); };
    Parts out;
    switch (one.op) {
        case kVectorTimesScalar:
        case kMatrixTimesScalar: {
            const Parts a = parts(one.in[0]);
            const Part scalar = parts(one.in[1])[0];
            for (size_t i = 0; i < a.size(); ++i)
                out.push_back(operation(name(i), "{0} * {1}", 'f', {a[i], scalar}));
            break;
        }
        case kMatrixTimesVector: {
            const Parts matrix = parts(one.in[0]), vector = parts(one.in[1]);
            const size_t rows = matrix.size() / vector.size();
            for (size_t row = 0; row < rows; ++row) {
                Parts along;
                for (size_t column = 0; column < vector.size(); ++column)
                    along.push_back(matrix[column * rows + row]);
                out.push_back(dot(name(row), along, vector));
            }
            break;
        }
        case kDot:
            out.push_back(dot(name(0), parts(one.in[0]), parts(one.in[1])));
            break;
        case kAny:
        case kAll: {
            const Parts a = parts(one.in[0]);
            std::string all = "{0}";
            for (size_t i = 1; i < a.size(); ++i)
                all = fmt::format("{}({}, {{{}}})", one.op == kAny ? "lor" : "land", all, i);
            out.push_back(operation(name(0), all, 'b', a));
            break;
        }
        default:
            return false;
    }
    values_[one.id] = out;
    return true;
}

bool Translator::composite(const Instruction& one) {
    Parts out;
    const auto range = [&](uint32_t value, size_t first_index, Parts& whole, size_t& begin,
                           size_t& count) {
        whole = parts(value);
        uint32_t type = types_.at(value);
        begin = 0;
        for (size_t i = first_index; i < one.in.size(); ++i) {
            begin += module_.part_first(type, one.in[i]);
            type = module_.part_type(type, one.in[i]);
        }
        count = module_.scalars(type).size();
    };
    Parts whole;
    size_t begin = 0, count = 0;
    switch (one.op) {
        case kUndef:
            for (const char kind : module_.scalars(one.type))
                out.push_back(literal(kind, 0));
            break;
        case kCopyLogical:
        case kCopyObject:
            out = parts(one.in[0]);
            break;
        case kCompositeConstruct:
            for (const uint32_t id : one.in)
                for (const Part& part : parts(id))
                    out.push_back(part);
            break;
        case kCompositeExtract:
            range(one.in[0], 1, whole, begin, count);
            out.assign(whole.begin() + static_cast<ptrdiff_t>(begin),
                       whole.begin() + static_cast<ptrdiff_t>(begin + count));
            break;
        case kCompositeInsert: {
            range(one.in[1], 2, whole, begin, count);
            const Parts inserted = parts(one.in[0]);
            std::copy(inserted.begin(), inserted.end(),
                      whole.begin() + static_cast<ptrdiff_t>(begin));
            out = whole;
            break;
        }
        case kVectorShuffle: {
            whole = parts(one.in[0]);
            for (const Part& part : parts(one.in[1]))
                whole.push_back(part);
            for (size_t i = 2; i < one.in.size(); ++i)
                out.push_back(one.in[i] == ~0u ? literal(whole[0].kind, 0) : whole[one.in[i]]);
            break;
        }
        case kVectorExtractDynamic: {
            whole = parts(one.in[0]);
            std::string chosen = "{0}";
            for (size_t i = 1; i < whole.size(); ++i)
                chosen = fmt::format("select(ieq({{{}}}, {{T}}({}u)), {{{}}}, {})", whole.size(), i,
                                     i, chosen);
            const char kind = whole[0].kind;
            whole.push_back(parts(one.in[1])[0]);
            out.push_back(operation(fmt::format("v{}_0", one.id), chosen, kind, whole));
            break;
        }
        case kBitcast: {
            whole = parts(one.in[0]);
            const std::string kinds = module_.scalars(one.type);
            if (kinds.size() != whole.size())
                fail("OpBitcast between {} and {} numbers", whole.size(), kinds.size());
            for (size_t i = 0; i < kinds.size(); ++i)
                out.push_back(whole[i].kind == kinds[i]
                                  ? whole[i]
                                  : operation(fmt::format("v{}_{}", one.id, i),
                                              kinds[i] == 'f' ? "as_float({0})" : "as_uint({0})",
                                              kinds[i], {whole[i]}));
            break;
        }
        default:
            return false;
    }
    values_[one.id] = out;
    return true;
}

void Translator::extended(const Instruction& one) {
    const uint32_t number = one.in[1];
    const auto name = [&](size_t i) { return fmt::format("v{}_{}", one.id, i); };
    std::vector<Parts> in;
    for (size_t i = 2; i < one.in.size(); ++i)
        in.push_back(parts(one.in[i]));
    Parts out;
    const auto of_vector = [&](const std::string& square) { return "fsqrt(" + square + ")"; };
    if (module_.is_wide(one.type)) {
        if (number != 38 && number != 41) // UMin, UMax
            fail("function {} of GLSL.std.450 is not translated for 64 bits", number);
        const std::string is_first = "lor(ult({1}, {3}), land(ieq({1}, {3}), ult({0}, {2})))";
        for (size_t i = 0; i < 2; ++i)
            out.push_back(operation(name(i),
                                    fmt::format("select({}, {{{}}}, {{{}}})", is_first,
                                                number == 38 ? i : i + 2, number == 38 ? i + 2 : i),
                                    'u', {in[0][0], in[0][1], in[1][0], in[1][1]}));
        values_[one.id] = out;
        return;
    }
    const auto sum_of_squares = [&](size_t count) {
        std::string sum = "{0} * {0}";
        for (size_t i = 1; i < count; ++i)
            sum += fmt::format(" + {{{}}} * {{{}}}", i, i);
        return sum;
    };
    if (const auto found = extended_operations().find(number);
        found != extended_operations().end()) {
        for (size_t i = 0; i < in[0].size(); ++i) {
            Parts each;
            for (const Parts& operand : in)
                each.push_back(operand[i]);
            out.push_back(operation(name(i), found->second.text, found->second.kind, each));
        }
    } else if (number == 66) { // Length
        out.push_back(operation(name(0), of_vector(sum_of_squares(in[0].size())), 'f', in[0]));
    } else if (number == 67 || number == 69) { // Distance, Normalize
        Parts v = in[0];
        if (number == 67)
            for (size_t i = 0; i < v.size(); ++i)
                v[i] = operation(fmt::format("v{}_d{}", one.id, i), "{0} - {1}", 'f',
                                 {in[0][i], in[1][i]});
        const Part length = operation(number == 67 ? name(0) : fmt::format("v{}_l", one.id),
                                      of_vector(sum_of_squares(v.size())), 'f', v);
        if (number == 67)
            out.push_back(length);
        else
            for (size_t i = 0; i < v.size(); ++i)
                out.push_back(operation(name(i), "{0} / {1}", 'f', {v[i], length}));
    } else if (number == 68) { // Cross
        for (size_t i = 0; i < 3; ++i) {
            const size_t j = (i + 1) % 3, k = (i + 2) % 3;
            out.push_back(operation(name(i), "{0} * {1} - {2} * {3}", 'f',
                                    {in[0][j], in[1][k], in[0][k], in[1][j]}));
        }
    } else if (number == 57) { // PackUnorm2x16
        out.push_back(operation(name(0), "pack_unorm16({0}, {1})", 'u', in[0]));
    } else if (number == 61) { // UnpackUnorm2x16
        out.push_back(operation(name(0), "from_unorm16({0})", 'f', in[0]));
        out.push_back(operation(name(1), "from_unorm16(shr({0}, {T}(16u)))", 'f', in[0]));
    } else {
        fail("function {} of GLSL.std.450 is not translated", number);
    }
    values_[one.id] = out;
}

bool Translator::group(const Instruction& one) {
    const auto varying = [&](char kind, const std::string& call) {
        values_[one.id] = {define(fmt::format("v{}_0", one.id), kind, false, call)};
    };
    switch (one.op) {
        case kGroupNonUniformElect:
            varying('b', fmt::format("subgroup_elect({})", mask()));
            return true;
        case kGroupNonUniformAll:
        case kGroupNonUniformAny: {
            const Part value = parts(one.in[1])[0];
            if (value.uniform)
                values_[one.id] = {value};
            else
                varying('b', fmt::format("subgroup_{}({}, {})",
                                         one.op == kGroupNonUniformAny ? "any" : "all", text(value),
                                         mask()));
            return true;
        }
        case kGroupNonUniformBroadcastFirst: {
            const Part value = parts(one.in[1])[0];
            if (value.uniform)
                values_[one.id] = {value};
            else
                varying(value.kind, fmt::format("subgroup_first({}, {})", text(value), mask()));
            return true;
        }
        case kGroupNonUniformIAdd: {
            const char* scans[] = {"kReduce", "kInclusive", "kExclusive"};
            if (one.in[1] > 2)
                fail("group operation {} is not translated", one.in[1]);
            varying('u', fmt::format("subgroup_add<Scan::{}>({}, {})", scans[one.in[1]],
                                     lanes(parts(one.in[2])[0]), mask()));
            return true;
        }
        // Groups with barriers run side by side, all lanes at once.
        case kControlBarrier:
        case kMemoryBarrier:
            return true;
        default:
            return false;
    }
}

void Translator::instruction(const Instruction& one) {
    types_[one.id] = one.type;
    if (one.op == kLoad) {
        if (images_.contains(one.in[0])) {
            images_[one.id] = images_[one.in[0]];
            return;
        }
        const bool is_input =
            inputs_.contains(one.in[0]) ||
            (module_.made.contains(one.in[0]) && module_.at(one.in[0]).in[0] == kInput);
        values_[one.id] =
            is_input ? parts(one.in[0]) : load(pointer(one.in[0]), fmt::format("v{}", one.id));
    } else if (one.op == kAccessChain) {
        const Instruction* base =
            module_.made.contains(one.in[0]) ? &module_.at(one.in[0]) : nullptr;
        if (base && base->in[0] == kInput) { // gl_LocalInvocationID.x
            values_[one.id] = {parts(one.in[0])[module_.constant(one.in[1])]};
            inputs_.insert(one.id);
        } else {
            access_chain(one);
        }
    } else if (one.op == kStore) {
        store(pointer(one.in[0]), parts(one.in[1]));
    } else if (one.op == kArrayLength) {
        const Pointer at = pointer(one.in[0]);
        const uint32_t member = one.in[1];
        const uint32_t array = module_.at(at.type).in[member];
        values_[one.id] = {
            define(fmt::format("v{}_0", one.id), 'u', true,
                   fmt::format("array_length(b{}, {}, {})", at.base,
                               module_.member_word(at.type, member), module_.stride_words(array)))};
    } else if (one.op >= kAtomicLoad && one.op <= kAtomicXor) {
        atomic(one);
    } else if (one.op == kExtInst) {
        extended(one);
    } else if (!composite(one) && !elementwise(one) && !algebra(one) && !group(one) &&
               !image_instruction(one)) {
        fail("{} ({}) is not translated", name_of(one.op) ? name_of(one.op) : "an instruction",
             one.op);
    }
}

} // namespace translator
