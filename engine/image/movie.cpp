#include "engine/image/movie.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "engine/base/file.h"

extern char** environ;

namespace palpate {

namespace fs = std::filesystem;

namespace {

fs::path encoder() {
    const char* path = std::getenv("PATH");
    std::istringstream entries(path ? path : "");
    for (std::string entry; std::getline(entries, entry, ':');)
        if (const fs::path program = fs::path(entry) / "ffmpeg";
            ::access(program.c_str(), X_OK) == 0)
            return program;
    return {};
}

Result<void> run(std::vector<std::string> words, const fs::path& folder,
                 const std::stop_token& stop) {
    std::vector<char*> arguments;
    for (std::string& word : words)
        arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    ::posix_spawnattr_setpgroup(&attributes, 0); // Ctrl-C is this program's to handle
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    pid_t pid = 0;
    const int failed =
        ::posix_spawn(&pid, arguments[0], &actions, &attributes, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::posix_spawnattr_destroy(&attributes);
    if (failed)
        return fail("ffmpeg cannot be started: {}", std::strerror(failed));
    int status = 0;
    while (::waitpid(pid, &status, WNOHANG) == 0) {
        if (stop.stop_requested())
            ::kill(pid, SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    if (stop.stop_requested())
        return fail("interrupted");
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        return fail("ffmpeg failed with status {}",
                    WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
    return {};
}

} // namespace

Result<void> expect_movie_encoder() {
    if (encoder().empty())
        return fail("expected the program ffmpeg on PATH, which makes movies, found none");
    return {};
}

fs::path movie_frame_name(size_t number) {
    return fmt::format("{:06}.png", number);
}

Result<void> make_movie(const fs::path& frames, double frames_per_s, const fs::path& path,
                        const std::stop_token& stop) {
    PALPATE_TRY(expect_movie_encoder());
    Result<void> made = write_atomically(fs::absolute(path), [&](const fs::path& temporary) {
        return run({fs::absolute(encoder()).string(),
                    "-nostdin",
                    "-loglevel",
                    "error",
                    "-y",
                    "-framerate",
                    fmt::format("{}", frames_per_s),
                    "-i",
                    "%06d.png",
                    "-vf",
                    "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                    "-c:v",
                    "libx264",
                    "-crf",
                    "18",
                    "-pix_fmt",
                    "yuv420p",
                    "-movflags",
                    "+faststart",
                    "-f",
                    "mp4",
                    temporary.string()},
                   frames, stop);
    });
    if (!made)
        return fail("{}: {}", path.string(), made.error().message);
    return {};
}

} // namespace palpate
