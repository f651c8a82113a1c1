#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <ostream>
#include <string>

#include "bench/cases/hard_case.h"

namespace palpate::cases {

inline void PrintTo(const HardCase& hard_case, std::ostream* out) {
    *out << hard_case.name << ": " << hard_case.why;
}

} // namespace palpate::cases

namespace palpate {

// Every line of a hard case must have measured something, and have found it within its bound.
inline void expect_pass(const std::vector<cases::Line>& lines) {
    EXPECT_FALSE(lines.empty());
    for (const cases::Line& line : lines) {
        EXPECT_GT(line.checks, 0u) << line.part;
        EXPECT_EQ(line.failed, 0u) << line.part << ": " << line.failed << " of " << line.checks
                                   << "; " << line.sentence << "; worst at " << line.worst;
        std::printf("    %s: %.2e of %.2e (%s)\n", line.part.c_str(), line.figure, line.bound,
                    line.worst.c_str());
    }
}

// "R7_cancellation_in_1_1_a_k", for the name of a test.
inline std::string hard_case_name(const testing::TestParamInfo<cases::HardCase>& info) {
    std::string name = std::string(info.param.name) + "_" + info.param.title;
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c)))
            c = '_';
    name.erase(
        std::unique(name.begin(), name.end(), [](char a, char b) { return a == '_' && b == '_'; }),
        name.end());
    return name;
}

} // namespace palpate
