#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <vector>

// Whether the memory of a long run grows.
namespace palpate {

inline double resident_mib() {
    std::ifstream file("/proc/self/statm");
    double all = 0, resident = 0;
    file >> all >> resident;
    return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) * 0x1p-20;
}

// The slope of a line through values that are one apart, by Theil and Sen: half of the slopes
// between pairs lie below. At least two values.
inline double slope(const std::vector<double>& values) {
    std::vector<double> slopes;
    for (size_t i = 0; i < values.size(); ++i)
        for (size_t j = i + 1; j < values.size(); ++j)
            slopes.push_back((values[j] - values[i]) / static_cast<double>(j - i));
    std::nth_element(slopes.begin(), slopes.begin() + static_cast<long>(slopes.size() / 2),
                     slopes.end());
    return slopes[slopes.size() / 2];
}

// `lowest_mib`: the lowest resident memory of each minute, the last of which may be part of one.
//
// The first third warms up: pipelines, caches. What grows afterwards would be there at the end of a
// day: 1 MiB a minute is 1.4 GiB. The minutes scatter by 5 MiB (standard deviation), which makes n
// of them a slope that is uncertain by 5 sqrt(12 / n^3): twice that is less than the limit from n =
// 11 on, in a run of 17 minutes.
inline void expect_flat_memory(std::vector<double> lowest_mib) {
    constexpr size_t kMinutes = 11;
    if (lowest_mib.empty())
        return;
    lowest_mib.pop_back();
    lowest_mib.erase(lowest_mib.begin(), lowest_mib.begin() + ptrdiff_t(lowest_mib.size() / 3));
    if (lowest_mib.size() < 2)
        return;
    for (const double lowest : lowest_mib)
        std::printf("    %.1f", lowest);
    std::printf(" MiB at least in each minute after the first third, %+.2f MiB a minute\n",
                slope(lowest_mib));
    if (lowest_mib.size() >= kMinutes) {
        EXPECT_LT(slope(lowest_mib), 1.0);
    }
}

} // namespace palpate
