#include "bench/suite/spawn.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

extern char** environ;

namespace palpate::bench {

Result<int> spawn(std::vector<std::string> command, std::span<const Redirection> redirections) {
    std::vector<char*> arguments;
    for (std::string& word : command)
        arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    for (const Redirection& one : redirections)
        if (one.file.empty())
            ::posix_spawn_file_actions_adddup2(&actions, one.from, one.descriptor);
        else
            ::posix_spawn_file_actions_addopen(&actions, one.descriptor, one.file.c_str(),
                                               O_WRONLY | O_CREAT | O_TRUNC, 0644);
    pid_t child = 0;
    const int failed =
        ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (failed)
        return fail("{}: cannot be started: {}", command[0], std::strerror(failed));
    return child;
}

int wait_for(int child) {
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

} // namespace palpate::bench
