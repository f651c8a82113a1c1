#include "engine/decode/serve.h"

#include <malloc.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <exception>
#include <fstream>
#include <new>
#include <string_view>

#include "engine/base/option_name.h"
#include "engine/io/report.h"
#include "engine/io/sandbox.h"

namespace palpate::io {

namespace {

// The memory that a reader may take for itself before the size of its file is known and checked.
// With the program and its libraries this stays below 512 MiB.
constexpr uint64_t kHeaderBytes = 384 << 20;

void limit_memory() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) // they map terabytes
    ::mallopt(M_ARENA_MAX, 1);                                      // each thread's maps 64 MiB
    uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit limit{};
    ::getrlimit(RLIMIT_AS, &limit);
    limit.rlim_cur = std::min<rlim_t>(
        pages * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE)) + kHeaderBytes, limit.rlim_max);
    ::setrlimit(RLIMIT_AS, &limit);
#endif
}

} // namespace

void serve_decoding(int argc, char** argv, Decode decode) {
    if (argc < 12)
        ::_exit(2);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != std::atoi(argv[2]))
        ::_exit(1);
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    limit_memory();

    DecodeRequest request;
    request.path = argv[4];
    if (const std::string_view frame = argv[5]; frame != "-")
        request.frame = static_cast<uint32_t>(std::strtoul(argv[5], nullptr, 10));
    if (const std::string_view series = argv[6]; series.starts_with('='))
        request.series = std::string(series.substr(1));
    request.resample_slices = std::string_view(argv[7]) == "resample";
    request.middle_image = std::string_view(argv[8]) == "middle";
    request.reference = std::string_view(argv[8]) == "reference";
    if (std::string_view(argv[9]) == "keyword")
        set_option_style(OptionStyle::keywords);
    if (const std::string_view onto = argv[10]; onto.starts_with('='))
        request.onto = onto.substr(1);
    if (const std::string_view series = argv[11]; series.starts_with('='))
        request.onto_series = std::string(series.substr(1));
    request.without.assign(argv + 12, argv + argc);
    VoxelSink sink(kMemoryFd, kReportFd, std::strtoull(argv[3], nullptr, 10));
    sink.alive();
    std::string report;
    try {
        const Result<Decoded> decoded = decode(request, sink);
        report = decoded ? decoded_report(*decoded) : error_report(decoded.error().message);
    } catch (const std::bad_alloc&) {
        report = error_report(request.path.string() +
                              ": reading needs more memory than its size justifies");
    } catch (const std::exception& error) {
        report = error_report(request.path.string() + ": cannot be read: " + error.what());
    }
    write_report(kReportFd, report);
    ::_exit(0);
}

} // namespace palpate::io
