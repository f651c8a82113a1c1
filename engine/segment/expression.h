#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// An arithmetic expression of several values, compiled once and evaluated for many samples at once:
//   numbers, names, + - * / ^ (power), comparisons < <= > >= == != (1 or 0), ! && ||, parentheses,
//   min(a, b, ..) max(a, b, ..) abs(a) sqrt(a) exp(a) log(a) pow(a, b) round(a) clamp(a, low, high)
//   where(condition, a, b), has(a): 1 where a has data, else 0.
// Binding from strong to weak: ^ (from the right), unary - and !, * /, + -, comparisons, &&, ||.
// Arithmetic is float. NaN is no data: a result that reads it is NaN, except by has(), and by
// where() on the side that is not taken. What is not finite (1/0) is no data, too.
class Expression {
 public:
    // `names` are those that may appear. The error is one sentence with the column, from 1.
    static Result<Expression> compile(std::string_view text, std::span<const std::string> names);

    // The result is a comparison or a combination of such: 1 or 0.
    bool is_logical() const { return is_logical_; }

    // inputs[i]: `count` values of names[i]; null where uses(i) is false. out: `count` values.
    // count: a multiple of 8.
    bool uses(size_t name) const { return used_[name]; }
    void evaluate(std::span<const float* const> inputs, size_t count, float* out) const;

    enum class Op : uint8_t {
        add,
        subtract,
        multiply,
        divide,
        power,
        less,
        less_equal,
        equal,
        not_equal,
        both,
        either,
        minimum,
        maximum,
        negate,
        invert,
        absolute,
        root,
        exponential,
        logarithm,
        nearest,
        has,
        where
    };

 private:
    friend class ExpressionParser;
    struct Step {
        Op op;
        uint16_t to, a, b, c; // registers: inputs, then constants, then temporary ones
    };

    std::vector<Step> steps_;
    std::vector<float> constants_;
    std::vector<bool> used_;
    size_t registers_ = 0; // temporary ones
    uint16_t result_ = 0;
    bool is_logical_ = false;
};

} // namespace palpate
