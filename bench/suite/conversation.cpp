#include "bench/suite/conversation.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "bench/suite/peers.h"
#include "bench/suite/spawn.h"

namespace palpate::bench {

Conversation::~Conversation() {
    if (!socket_)
        return;
    ::close(socket_.release());
    wait_for(child_);
}

Result<Conversation> Conversation::start(std::vector<std::string> command, const fs::path& said) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return fail("{}: no socket to talk through: {}", command[0], std::strerror(errno));
    Fd ours(ends[0]);
    const Fd theirs(ends[1]);
    const std::array redirections{Redirection{.descriptor = 0, .from = ends[1]},
                                  Redirection{.descriptor = 1, .from = ends[1]},
                                  Redirection{.descriptor = 2, .file = said}};
    PALPATE_TRY(const int child, spawn(std::move(command), redirections));
    return Conversation(std::move(ours), child, said);
}

Result<Json> Conversation::ask(const Json& question) {
    const std::string line = json_line(question) + "\n";
    for (size_t sent = 0; sent < line.size();) {
        const ssize_t n =
            ::send(socket_.get(), line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return fail("it ended: {}", last_line(said_));
        sent += static_cast<size_t>(n);
    }
    size_t end;
    while ((end = heard_.find('\n')) == std::string::npos) {
        char piece[4096];
        const ssize_t n = ::recv(socket_.get(), piece, sizeof piece, 0);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return fail("it ended: {}", last_line(said_));
        heard_.append(piece, static_cast<size_t>(n));
    }
    Result<Json> answer = parse_json(heard_.substr(0, end), "answer");
    if (!answer)
        return fail("expected an answer in JSON, found '{}'", heard_.substr(0, end));
    heard_.erase(0, end + 1);
    return answer;
}

} // namespace palpate::bench
