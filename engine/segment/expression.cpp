#include "engine/segment/expression.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/base/clones.h"

namespace palpate {

namespace {

using Op = Expression::Op;
constexpr size_t kChunk = 512; // samples: registers stay in the nearest cache

struct Function {
    const char* name;
    int least, most; // arguments
    Op op;
};
constexpr int kMany = 100;
constexpr Function kFunctions[] = {
    {"min", 2, kMany, Op::minimum}, {"max", 2, kMany, Op::maximum}, {"abs", 1, 1, Op::absolute},
    {"sqrt", 1, 1, Op::root},       {"exp", 1, 1, Op::exponential}, {"log", 1, 1, Op::logarithm},
    {"pow", 2, 2, Op::power},       {"round", 1, 1, Op::nearest},   {"clamp", 3, 3, Op::minimum},
    {"where", 3, 3, Op::where},     {"has", 1, 1, Op::has}};

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// Eight floats at once: two registers, or one with AVX2 (clones.h).
using Eight = float __attribute__((vector_size(32)));

[[gnu::always_inline]] inline Eight load(const float* from) {
    Eight v;
    std::memcpy(&v, from, sizeof v);
    return v;
}

// n is a multiple of 8. `to` may be one of the operands.
PALPATE_CLONES void run(Op op, float* to, const float* a, const float* b, const float* c,
                        size_t n) {
    const Eight zero{}, one = zero + 1.0f, none = zero + kNone;
// An expression of eight values x of a and y of b; of two that must both have data; of single ones.
#define PALPATE_EIGHT(expression)                                      \
    for (size_t i = 0; i < n; i += 8) {                                \
        [[maybe_unused]] const Eight x = load(a + i), y = load(b + i); \
        const Eight made = (expression);                               \
        std::memcpy(to + i, &made, sizeof made);                       \
    }                                                                  \
    break
#define PALPATE_TRUTH(condition) \
    PALPATE_EIGHT((x == x) & (y == y) ? (condition) ? one : zero : none)
#define PALPATE_ONE(expression)         \
    for (size_t i = 0; i < n; ++i) {    \
        const float x = a[i], y = b[i]; \
        to[i] = (expression);           \
        (void)y;                        \
    }                                   \
    break
    switch (op) {
        case Op::add:
            PALPATE_EIGHT(x + y);
        case Op::subtract:
            PALPATE_EIGHT(x - y);
        case Op::multiply:
            PALPATE_EIGHT(x * y);
        case Op::divide:
            PALPATE_EIGHT(x / y);
        case Op::less:
            PALPATE_TRUTH(x < y);
        case Op::less_equal:
            PALPATE_TRUTH(x <= y);
        case Op::equal:
            PALPATE_TRUTH(x == y);
        case Op::not_equal:
            PALPATE_TRUTH(x != y);
        case Op::both:
            PALPATE_TRUTH((x != zero) & (y != zero));
        case Op::either:
            PALPATE_TRUTH((x != zero) | (y != zero));
        case Op::minimum:
            PALPATE_EIGHT((y < x) | (y != y) ? y : x);
        case Op::maximum:
            PALPATE_EIGHT((y > x) | (y != y) ? y : x);
        case Op::negate:
            PALPATE_EIGHT(zero - x);
        case Op::invert:
            PALPATE_TRUTH(x == zero);
        case Op::absolute:
            PALPATE_EIGHT(x < zero ? -x : x);
        case Op::has:
            PALPATE_EIGHT(x == x ? one : zero);
        case Op::where:
            for (size_t i = 0; i < n; i += 8) {
                const Eight x = load(a + i), y = load(b + i), z = load(c + i);
                const Eight made = x != x ? none : x != zero ? y : z;
                std::memcpy(to + i, &made, sizeof made);
            }
            break;
        case Op::root:
            PALPATE_ONE(std::sqrt(x));
        case Op::nearest:
            PALPATE_ONE(std::nearbyint(x));
        case Op::power:
            PALPATE_ONE(std::isnan(x) || std::isnan(y) ? kNone : std::pow(x, y));
        case Op::exponential:
            PALPATE_ONE(std::exp(x));
        case Op::logarithm:
            PALPATE_ONE(std::log(x));
    }
#undef PALPATE_EIGHT
#undef PALPATE_TRUTH
#undef PALPATE_ONE
}

} // namespace

void Expression::evaluate(std::span<const float* const> inputs, size_t count, float* out) const {
    thread_local std::vector<float> memory;
    memory.resize((constants_.size() + registers_) * kChunk);
    std::vector<float*> own(constants_.size() + registers_);
    for (size_t i = 0; i < own.size(); ++i)
        own[i] = memory.data() + i * kChunk;
    for (size_t i = 0; i < constants_.size(); ++i)
        std::fill_n(own[i], kChunk, constants_[i]);
    for (size_t start = 0; start < count; start += kChunk) {
        const size_t n = std::min(kChunk, count - start);
        const auto at = [&](uint16_t r) -> const float* {
            return r < inputs.size() ? inputs[r] + start : own[r - inputs.size()];
        };
        for (const Step& step : steps_)
            run(step.op, own[step.to - inputs.size()], at(step.a), at(step.b), at(step.c), n);
        std::copy_n(at(result_), n, out + start);
    }
}

// Recursive descent. Temporary registers are a stack: an operation's result takes the place of its
// lowest temporary operand.
class ExpressionParser {
 public:
    ExpressionParser(std::string_view text, std::span<const std::string> names)
        : text_(text), names_(names) {
        made_.used_.assign(names.size(), false);
    }

    Result<Expression> parse() {
        PALPATE_TRY(const Value value, either(0));
        if (peek() != '\0')
            return expected("an operator or the end");
        made_.result_ = place(value);
        made_.is_logical_ = value.logical;
        // Places were counted apart for constants and temporaries; now they follow the inputs.
        const size_t first_constant = names_.size();
        const size_t first_temporary = first_constant + made_.constants_.size();
        const auto settle = [&](uint16_t& r) {
            if (r & kTemporary)
                r = uint16_t(first_temporary + (r & kIndex));
            else if (r & kConstant)
                r = uint16_t(first_constant + (r & kIndex));
        };
        for (Expression::Step& step : made_.steps_)
            for (uint16_t* r : {&step.to, &step.a, &step.b, &step.c})
                settle(*r);
        settle(made_.result_);
        return std::move(made_);
    }

 private:
    static constexpr uint16_t kTemporary = 0x8000, kConstant = 0x4000, kIndex = 0x3fff;
    static constexpr int kDeepest = 200;
    static constexpr size_t kMostSteps = 4096;

    struct Value {
        uint16_t place;
        bool logical = false;
    };

    static uint16_t place(const Value& v) { return v.place; }

    tl::unexpected<Error> expected(const std::string& what) {
        peek();
        const std::string found =
            at_ == text_.size() ? "the end" : fmt::format("'{}'", text_.substr(at_, 12));
        return fail("column {}: expected {}, found {}", at_ + 1, what, found);
    }
    char peek() {
        while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t'))
            ++at_;
        return at_ < text_.size() ? text_[at_] : '\0';
    }
    bool take(std::string_view word) {
        peek();
        if (text_.substr(at_, word.size()) != word)
            return false;
        at_ += word.size();
        return true;
    }

    // Appends an operation; its operands are the topmost temporaries, if they are any.
    Result<Value> apply(Op op, Value a, Value b, Value c, bool logical) {
        if (made_.steps_.size() >= kMostSteps)
            return fail("column {}: expected at most {} operations", at_ + 1, kMostSteps);
        uint16_t low = uint16_t(top_);
        for (const Value& v : {a, b, c})
            if (v.place & kTemporary)
                low = std::min(low, uint16_t(v.place & kIndex));
        top_ = size_t(low) + 1;
        made_.registers_ = std::max(made_.registers_, top_);
        made_.steps_.push_back({op, uint16_t(kTemporary | low), a.place, b.place, c.place});
        return Value{uint16_t(kTemporary | low), logical};
    }

    Result<Value> either(int depth) {
        PALPATE_TRY(Value left, both(depth));
        while (take("||")) {
            PALPATE_TRY(const Value right, both(depth));
            PALPATE_TRY(left, apply(Op::either, left, right, right, true));
        }
        return left;
    }
    Result<Value> both(int depth) {
        PALPATE_TRY(Value left, comparison(depth));
        while (take("&&")) {
            PALPATE_TRY(const Value right, comparison(depth));
            PALPATE_TRY(left, apply(Op::both, left, right, right, true));
        }
        return left;
    }
    Result<Value> comparison(int depth) {
        PALPATE_TRY(const Value left, sum(depth));
        struct Sign {
            const char* text;
            Op op;
            bool swapped;
        };
        for (const Sign& sign : {Sign{"<=", Op::less_equal, false},
                                 {">=", Op::less_equal, true},
                                 {"==", Op::equal, false},
                                 {"!=", Op::not_equal, false},
                                 {"<", Op::less, false},
                                 {">", Op::less, true}})
            if (take(sign.text)) {
                PALPATE_TRY(const Value right, sum(depth));
                return sign.swapped ? apply(sign.op, right, left, left, true)
                                    : apply(sign.op, left, right, right, true);
            }
        return left;
    }
    Result<Value> sum(int depth) {
        PALPATE_TRY(Value left, product(depth));
        for (;;) {
            const char sign = peek();
            if (sign != '+' && sign != '-')
                return left;
            ++at_;
            PALPATE_TRY(const Value right, product(depth));
            PALPATE_TRY(left,
                        apply(sign == '+' ? Op::add : Op::subtract, left, right, right, false));
        }
    }
    Result<Value> product(int depth) {
        PALPATE_TRY(Value left, unary(depth));
        for (;;) {
            const char sign = peek();
            if (sign != '*' && sign != '/')
                return left;
            ++at_;
            PALPATE_TRY(const Value right, unary(depth));
            PALPATE_TRY(left,
                        apply(sign == '*' ? Op::multiply : Op::divide, left, right, right, false));
        }
    }
    Result<Value> unary(int depth) {
        if (depth > kDeepest)
            return fail("column {}: expected at most {} nested parts", at_ + 1, kDeepest);
        if (take("-")) {
            PALPATE_TRY(const Value value, unary(depth + 1));
            return apply(Op::negate, value, value, value, false);
        }
        if (peek() == '!' && text_.substr(at_, 2) != "!=") {
            ++at_;
            PALPATE_TRY(const Value value, unary(depth + 1));
            return apply(Op::invert, value, value, value, true);
        }
        PALPATE_TRY(const Value base, primary(depth));
        if (!take("^"))
            return base;
        PALPATE_TRY(const Value exponent, unary(depth + 1));
        return apply(Op::power, base, exponent, exponent, false);
    }
    Result<Value> primary(int depth) {
        const char c = peek();
        if (c == '(') {
            ++at_;
            PALPATE_TRY(const Value value, either(depth + 1));
            if (!take(")"))
                return expected("')'");
            return value;
        }
        if ((c >= '0' && c <= '9') || c == '.')
            return number();
        const size_t start = at_;
        const auto is_letter = [](char l) {
            return (l >= 'a' && l <= 'z') || (l >= 'A' && l <= 'Z') || l == '_';
        };
        while (at_ < text_.size() &&
               (is_letter(text_[at_]) || (at_ > start && text_[at_] >= '0' && text_[at_] <= '9')))
            ++at_;
        const std::string_view word = text_.substr(start, at_ - start);
        if (word.empty())
            return expected("a number, a name or '('");
        if (peek() == '(') {
            for (const Function& function : kFunctions)
                if (word == function.name)
                    return call(function, depth);
            at_ = start;
            return expected(
                "a function (min, max, abs, sqrt, exp, log, pow, round, clamp, where, "
                "has)");
        }
        for (size_t i = 0; i < names_.size(); ++i)
            if (word == names_[i]) {
                made_.used_[i] = true;
                return Value{uint16_t(i)};
            }
        at_ = start;
        std::string known;
        for (const std::string& name : names_)
            known += (known.empty() ? "" : ", ") + name;
        return expected(fmt::format("a volume ({})", known));
    }
    Result<Value> number() {
        const std::string rest(text_.substr(at_, 64));
        char* end = nullptr;
        const float value = std::strtof(rest.c_str(), &end);
        if (end == rest.c_str() || !std::isfinite(value))
            return expected("a number that is finite in float");
        at_ += size_t(end - rest.c_str());
        made_.constants_.push_back(value);
        if (made_.constants_.size() > kMostSteps)
            return fail("column {}: expected at most {} numbers", at_, kMostSteps);
        return Value{uint16_t(kConstant | (made_.constants_.size() - 1))};
    }
    Result<Value> call(const Function& function, int depth) {
        const size_t name_at = at_;
        std::vector<Value> arguments;
        take("(");
        do {
            PALPATE_TRY(const Value value, either(depth + 1));
            arguments.push_back(value);
        } while (take(","));
        if (!take(")"))
            return expected("',' or ')'");
        const int count = int(arguments.size());
        if (count < function.least || count > function.most)
            return fail("column {}: expected {}{} argument{} of {}(), found {}", name_at + 1,
                        function.least, function.most == kMany ? " or more" : "",
                        function.least == 1 ? "" : "s", function.name, count);
        Value value = arguments[0];
        const std::string_view name = function.name;
        if (name == "clamp") {
            PALPATE_TRY(value, apply(Op::maximum, value, arguments[1], arguments[1], false));
            return apply(Op::minimum, value, arguments[2], arguments[2], false);
        }
        if (name == "where") {
            const bool logical = arguments[1].logical && arguments[2].logical;
            return apply(Op::where, value, arguments[1], arguments[2], logical);
        }
        if (count == 1)
            return apply(function.op, value, value, value, function.op == Op::has);
        for (size_t i = 1; i < arguments.size(); ++i) {
            PALPATE_TRY(value, apply(function.op, value, arguments[i], arguments[i], false));
        }
        return value;
    }

    std::string_view text_;
    std::span<const std::string> names_;
    size_t at_ = 0;
    size_t top_ = 0; // temporaries in use
    Expression made_;
};

Result<Expression> Expression::compile(std::string_view text, std::span<const std::string> names) {
    return ExpressionParser(text, names).parse();
}

} // namespace palpate
