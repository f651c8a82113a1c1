#include "engine/io/sandbox.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <mutex>
#include <sstream>
#include <vector>

#include "engine/base/fd.h"
#include "engine/base/option_name.h"
#include "engine/base/timer.h"
#include "engine/io/report.h"

extern char** environ;

// The folder of the installed program palpate: in this build that of the configured prefix; in
// others' builds that of the prefix where they found the package (cmake/palpate-config.cmake.in).
extern "C" const char* palpate_installed_bin();

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

constexpr int kPollMs = 20;
constexpr size_t kMostReportBytes = 64 << 20;
constexpr size_t kMostStarts = 9; // of readers for one volume, each without a file more
constexpr double kWallPerCpu = 10.0;
constexpr double kSlowestBytesPerSecond = 4e6;      // decoded
constexpr double kSlowestFileBytesPerSecond = 20e6; // read, and unpacked to be counted

// The same file under a number that posix_spawn's dup2 to kMemoryFd, kReportFd cannot clobber.
Fd moved_up(const Fd& fd) {
    return Fd(::fcntl(fd.get(), F_DUPFD_CLOEXEC, 10));
}

// A running child; killed and waited for when it goes out of scope, so that none is left over.
class Child {
 public:
    Child(pid_t pid, Fd reports) : pid_(pid), reports_(std::move(reports)) {}
    ~Child() {
        if (pid_ > 0) {
            ::kill(pid_, SIGKILL);
            (void)wait();
        }
    }
    Child(Child&& other) noexcept
        : pid_(std::exchange(other.pid_, 0)), reports_(std::move(other.reports_)) {}

    int reports() const { return reports_.get(); }

    // Seconds of processor time used so far, by all its threads.
    double cpu_s() const {
        clockid_t clock;
        timespec time{};
        if (::clock_getcpuclockid(pid_, &clock) != 0 || ::clock_gettime(clock, &time) != 0)
            return 0;
        return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
    }

    // The exit status, as of waitpid.
    int wait() {
        int status = 0;
        while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
        }
        pid_ = 0;
        return status;
    }

 private:
    pid_t pid_;
    Fd reports_;
};

Result<Child> start_child(const DecodeRequest& request, const ReadOptions& options,
                          const Fd& memory) {
    const fs::path program = decoder_program();
    if (program.empty())
        return fail(
            "{}: cannot be decoded, because the program palpate is not found beside this "
            "program, in {}, or on PATH (PALPATE_DECODER may name it)",
            request.path.string(), palpate_installed_bin());
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0)
        return fail("{}: no pipe to a decoder: {}", request.path.string(), std::strerror(errno));
    Fd from_child(ends[0]);
    const Fd low_end(ends[1]);
    const Fd to_parent = moved_up(low_end);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    if (!std::getenv("PALPATE_DECODER_NOISE")) // for those who look into a reader's messages
        ::posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions, memory.get(), kMemoryFd);
    ::posix_spawn_file_actions_adddup2(&actions, to_parent.get(), kReportFd);
    ::posix_spawn_file_actions_addclosefrom_np(&actions, kReportFd + 1);

    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    sigset_t none, all;
    ::sigemptyset(&none);
    ::sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes, &none);
    ::posix_spawnattr_setsigdefault(&attributes, &all);
    ::posix_spawnattr_setpgroup(&attributes, 0); // Ctrl-C is the parent's to handle
    ::posix_spawnattr_setflags(
        &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);

    std::vector<std::string> words{program.string(),
                                   "__decode",
                                   std::to_string(::getpid()),
                                   std::to_string(options.max_memory_bytes),
                                   request.path.string(),
                                   request.frame ? std::to_string(*request.frame) : "-",
                                   request.series ? "=" + *request.series : "-",
                                   request.resample_slices ? "resample" : "-",
                                   request.middle_image ? "middle"
                                   : request.reference  ? "reference"
                                                        : "-",
                                   text_of(Option{"keyword"}),
                                   request.onto.empty() ? "-" : "=" + request.onto.string(),
                                   request.onto_series ? "=" + *request.onto_series : "-"};
    for (const fs::path& path : request.without)
        words.push_back(path.string());
    std::vector<char*> argv;
    for (const std::string& word : words)
        argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    pid_t pid = 0;
    const int failed =
        ::posix_spawn(&pid, program.c_str(), &actions, &attributes, argv.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::posix_spawnattr_destroy(&attributes);
    if (failed)
        return fail("{}: cannot be decoded, because {} does not start: {}", request.path.string(),
                    program.string(), std::strerror(failed));
    return Child(pid, std::move(from_child));
}

// Why a child ended without a result: how far it had come, and how it ended. What libraries print
// then is about their code, not the file.
std::string cause_of(int status, const Reported& reported) {
    const std::string how =
        WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT ? "its reader gave up"
        : WIFSIGNALED(status) ? fmt::format("the reader crashed (signal {}, {})", WTERMSIG(status),
                                            ::strsignal(WTERMSIG(status)))
                              : fmt::format("the reader ended without a result (exit status {})",
                                            WEXITSTATUS(status));
    return fmt::format("the {} damaged or not as its format demands: {}",
                       reported.claim ? "voxels are" : "header is", how);
}

Result<void> check_decoded(const Decoded& decoded, const VoxelClaim& claim) {
    if (decoded.grid.size != claim.size)
        return fail("its size changed while it was read");
    const glm::dmat4& m = decoded.grid.world_from_index;
    double longest = 0;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row)
            if (!std::isfinite(m[column][row]))
                return fail("its geometry is not finite");
        if (m[column][3] != (column == 3 ? 1.0 : 0.0))
            return fail("its geometry is not affine");
        if (column < 3)
            longest = std::max(longest, glm::length(m[column]));
    }
    // Below this, a volume of 10^5 samples a side would be thinner than a double resolves.
    if (!(std::abs(glm::determinant(glm::dmat3(m))) > 1e-12 * longest * longest * longest))
        return fail("its axes span no space (spacing or directions of zero)");
    if (decoded.rescale.size() > 1 && decoded.rescale.size() != claim.size.z)
        return fail("{} slices have {} rescale entries", claim.size.z, decoded.rescale.size());
    if (!decoded.padding.empty() && decoded.padding.size() != claim.size.z)
        return fail("{} slices have {} ranges of padding", claim.size.z, decoded.padding.size());
    for (const Rescale& rescale : decoded.rescale)
        if (!std::isfinite(rescale.slope) || !std::isfinite(rescale.intercept))
            return fail("its rescale slope or intercept is not finite");
    return {};
}

// How much of the voxels a child has written: shared memory has the pages that were written to.
double share_written(const Fd& memory, const VoxelClaim& claim) {
    constexpr double kBlock = 512.0; // POSIX: of st_blocks
    struct stat status {};
    const auto bytes = static_cast<double>(claimed_bytes(claim).value_or(0));
    if (bytes <= 0.0 || ::fstat(memory.get(), &status) != 0)
        return 0.0;
    return std::min(1.0, kBlock * static_cast<double>(status.st_blocks) / bytes);
}

// Listens to a child until its last word; the error has no file name yet.
// `file_s` are the seconds that reading the file once may take.
Result<void> listen(Child& child, const Fd& memory, const ReadOptions& options, double file_s,
                    Reported& reported) {
    std::string pending;
    size_t total = 0;
    Timer quiet_wall;
    double quiet_since_cpu_s = 0;
    while (!reported.decoded && !reported.error) {
        if (options.stop.stop_requested())
            return fail("reading was interrupted");
        double limit_s = options.max_quiet_s + file_s;
        if (reported.claim)
            limit_s += static_cast<double>(claimed_bytes(*reported.claim).value_or(0)) /
                       kSlowestBytesPerSecond;
        if (child.cpu_s() - quiet_since_cpu_s > limit_s ||
            quiet_wall.ms() > 1000 * kWallPerCpu * limit_s)
            return fail("the reader was stopped, because it got nowhere in {:.1f} s", limit_s);

        if (options.progress && reported.claim)
            options.progress(share_written(memory, *reported.claim));
        pollfd waiting{child.reports(), POLLIN, 0};
        if (::poll(&waiting, 1, kPollMs) <= 0)
            continue;
        char buffer[65536];
        const ssize_t got = ::read(child.reports(), buffer, sizeof buffer);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0) {
            return fail("{}", cause_of(child.wait(), reported));
        }
        total += static_cast<size_t>(got);
        if (total > kMostReportBytes)
            return fail("the reader was stopped, because it said too much");
        quiet_wall = Timer();
        quiet_since_cpu_s = child.cpu_s();
        pending.append(buffer, static_cast<size_t>(got));
        for (size_t end; (end = pending.find('\n')) != std::string::npos;) {
            if (Result<void> taken = take_report(pending.substr(0, end), reported); !taken)
                return fail("the reader's report makes no sense: {}", taken.error().message);
            pending.erase(0, end + 1);
        }
    }
    if (options.progress && reported.claim &&
        reported.decoded) // a quick reader was never looked at
        options.progress(share_written(memory, *reported.claim));
    return {};
}

double seconds_to_read(const fs::path& path) {
    std::error_code error;
    const uint64_t bytes = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
    return error ? 0.0 : static_cast<double>(bytes) / kSlowestFileBytesPerSecond;
}

bool is_executable(const fs::path& path) {
    return fs::is_regular_file(path) && ::access(path.c_str(), X_OK) == 0;
}

// Folders where the program palpate may lie for a module of this process (the running program, or a
// shared library that has these functions in it): bin/ beside it, or beside the folder of its
// platform (lib/x86_64-linux-gnu).
void append_folders_of(const fs::path& module, bool is_program, std::vector<fs::path>& folders) {
    if (module.empty())
        return;
    const fs::path folder = module.parent_path();
    if (is_program)
        folders.push_back(folder);
    folders.push_back(folder.parent_path() / "bin");
    if (!is_program)
        folders.push_back(folder.parent_path().parent_path() / "bin");
}

// The shared library that this function is in; empty in a program itself.
fs::path own_library() {
    Dl_info info{};
    void* found = nullptr;
    if (::dladdr1(reinterpret_cast<void*>(&own_library), &info, &found, RTLD_DL_LINKMAP) == 0)
        return {};
    const std::string name = static_cast<const link_map*>(found)->l_name; // empty: the program
    std::error_code error;
    return name.empty() ? fs::path() : fs::canonical(name, error);
}

struct SetProgram {
    std::mutex mutex;
    fs::path path;
};
SetProgram& set_program() {
    static SetProgram program;
    return program;
}

} // namespace

void set_decoder_program(fs::path program) {
    const std::lock_guard lock(set_program().mutex);
    set_program().path = std::move(program);
}

fs::path decoder_program() {
    {
        const std::lock_guard lock(set_program().mutex);
        if (!set_program().path.empty())
            return set_program().path;
    }
    if (const char* named = std::getenv("PALPATE_DECODER"))
        return named;
    std::vector<fs::path> folders;
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error);
    append_folders_of(program, true, folders);
    append_folders_of(own_library(), false, folders);
    folders.emplace_back(palpate_installed_bin());
    if (const char* path = std::getenv("PATH")) {
        std::istringstream entries(path);
        for (std::string entry; std::getline(entries, entry, ':');)
            folders.emplace_back(entry);
    }
    for (const fs::path& folder : folders)
        if (is_executable(folder / "palpate"))
            return folder / "palpate";
    return {};
}

namespace {

// Decodes in one child. `at` becomes the file that it worked on when it died or got nowhere.
Result<DecodedVoxels> decode_once(const DecodeRequest& request, const ReadOptions& options,
                                  fs::path& at) {
    const std::string name = request.path.string();
    const Fd low(::memfd_create("palpate-voxels", MFD_CLOEXEC));
    const Fd memory = moved_up(low);
    if (memory.get() < 0)
        return fail("{}: no shared memory to decode into: {}", name, std::strerror(errno));
    Reported reported;
    {
        PALPATE_TRY(Child child, start_child(request, options, memory));
        if (Result<void> heard =
                listen(child, memory, options, seconds_to_read(request.path), reported);
            !heard) {
            at = reported.at;
            return fail("{}: {}{}", name, heard.error().message,
                        at.empty() ? "" : ", while it read " + at.filename().string());
        }
    } // the child is gone: nobody can shrink the memory under the mapping
    if (reported.error)
        return fail("{}", *reported.error);
    if (reported.decoded->reference) // headers alone
        reported.claim = VoxelClaim{reported.decoded->grid.size};
    if (!reported.claim)
        return fail("{}: the reader's report makes no sense: it has no size", name);
    if (Result<void> checked = check_decoded(*reported.decoded, *reported.claim); !checked)
        return fail("{}: cannot be used: {}", name, checked.error().message);

    if (reported.decoded->reference)
        return DecodedVoxels{std::move(*reported.decoded), {}, {}};
    const std::optional<uint64_t> bytes = claimed_bytes(*reported.claim);
    struct stat status {};
    if (!bytes || ::fstat(memory.get(), &status) != 0 ||
        static_cast<uint64_t>(status.st_size) != *bytes)
        return fail("{}: the reader's report makes no sense: it left {} bytes", name,
                    status.st_size);
    void* const mapped = ::mmap(nullptr, *bytes, PROT_READ, MAP_SHARED, memory.get(), 0);
    if (mapped == MAP_FAILED)
        return fail("{}: no shared memory of {} bytes: {}", name, *bytes, std::strerror(errno));
    const size_t length = *bytes;
    return DecodedVoxels{std::move(*reported.decoded), *reported.claim,
                         std::shared_ptr<const std::byte>(
                             static_cast<const std::byte*>(mapped), [length](const std::byte* p) {
                                 ::munmap(const_cast<std::byte*>(p), length);
                             })};
}

} // namespace

Result<DecodedVoxels> decode_in_child(const DecodeRequest& request, const ReadOptions& options) {
    DecodeRequest wanted = request;
    for (;;) {
        fs::path at;
        Result<DecodedVoxels> decoded = decode_once(wanted, options, at);
        const bool again =
            !decoded && !at.empty() && at != request.path &&
            wanted.without.size() + 1 < kMostStarts &&
            std::find(wanted.without.begin(), wanted.without.end(), at) == wanted.without.end() &&
            !options.stop.stop_requested();
        if (!again)
            return decoded;
        wanted.without.push_back(at);
    }
}

} // namespace palpate::io
