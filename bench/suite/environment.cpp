#include "bench/suite/environment.h"

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <thread>

#include "engine/base/memory.h"
#include "engine/version/version.h"

namespace palpate::bench {

namespace {

double seconds(clockid_t clock) {
    timespec now{};
    ::clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Seconds that all processors of the machine have worked, or been held back, since it started; 0
// where the system does not say.
double busy_seconds() {
    std::ifstream file("/proc/stat");
    std::string word;
    double user = 0, nice = 0, system = 0, idle = 0, waiting = 0, irq = 0, soft = 0, stolen = 0;
    if (!(file >> word >> user >> nice >> system >> idle >> waiting >> irq >> soft >> stolen))
        return 0;
    return (user + nice + system + irq + soft + stolen) /
           static_cast<double>(::sysconf(_SC_CLK_TCK));
}

// Seconds that this program has worked, and the peers that it has run to their end.
double own_seconds() {
    rusage peers{};
    ::getrusage(RUSAGE_CHILDREN, &peers);
    const auto of = [](timeval t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(CLOCK_PROCESS_CPUTIME_ID) + of(peers.ru_utime) + of(peers.ru_stime);
}

std::string processor() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name"))
            return line.substr(line.find(':') + 2);
    return "unknown";
}

std::string system_name() {
    std::ifstream file("/etc/os-release");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("PRETTY_NAME=\""))
            return line.substr(13, line.size() - 14);
    return "unknown";
}

} // namespace

Json environment(const DeviceInfo& device) {
    Json v;
    v["commit"] = built_from();
    v["version"] = PALPATE_VERSION;
    v["compiler"] = PALPATE_COMPILER;
    v["build_type"] = PALPATE_BUILD_TYPE;
    v["device"] = device.name;
    v["driver"] = device.driver;
    v["device_memory_bytes"] = device.memory_bytes;
    v["cpu"] = processor();
    v["cores"] = std::thread::hardware_concurrency();
    v["memory_bytes"] = physical_memory_bytes();
    v["system"] = system_name();
    return v;
}

Neighbours::Neighbours()
    : busy_s_(busy_seconds()), own_s_(own_seconds()), wall_s_(seconds(CLOCK_MONOTONIC)) {}

double Neighbours::cores() const {
    const double busy = busy_seconds() - busy_s_ - (own_seconds() - own_s_);
    return std::max(0.0, busy) / std::max(seconds(CLOCK_MONOTONIC) - wall_s_, 1e-3);
}

double process_cpu_ms() {
    return 1e3 * seconds(CLOCK_PROCESS_CPUTIME_ID);
}

} // namespace palpate::bench
