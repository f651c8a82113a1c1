#pragma once

#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace palpate {

// Counts for a thread how often it was put to sleep or had to give way.
struct Switches {
    uint64_t asked = 0, forced = 0;
    uint64_t all() const { return asked + forced; }
};

// The switches of every thread of this process, by its number.
inline std::map<std::string, Switches> switches_now() {
    std::map<std::string, Switches> all;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
        std::ifstream status(task.path() / "status");
        Switches& found = all[task.path().filename()];
        for (std::string word; status >> word;)
            if (word == "voluntary_ctxt_switches:")
                status >> found.asked;
            else if (word == "nonvoluntary_ctxt_switches:")
                status >> found.forced;
    }
    return all;
}

inline double cpu_s_now() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

} // namespace palpate
