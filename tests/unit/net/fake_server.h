#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/glm.hpp>
#include <iterator>
#include <string>
#include <vector>

#include "engine/net/net_server.h"
#include "tests/support/paths.h"

namespace palpate {

// The volume that tests send.
constexpr glm::uvec3 kSentSize{20, 16, 12};

// The fake server's net: a ball of radius 3 about a point.
inline bool in_ball(glm::ivec3 at, glm::ivec3 center) {
    const glm::ivec3 d = at - center;
    return d.x * d.x + d.y * d.y + d.z * d.z <= 9;
}

// fake_server.py in a process of its own, which ends with this.
class FakeServer {
 public:
    // The server speaks as MONAI Label does where the folder's name ends in "monai".
    FakeServer(const std::filesystem::path& folder, const std::vector<std::string>& faults)
        : folder_(folder) {
        std::filesystem::create_directories(folder);
        int in[2], out[2];
        if (pipe(in) != 0 || pipe(out) != 0)
            std::abort();
        child_ = fork();
        if (child_ == 0) {
            dup2(in[0], 0);
            dup2(out[1], 1);
            for (const int fd : {in[0], in[1], out[0], out[1]})
                close(fd);
            const std::string script = std::string(kSourceDir) + "/tests/unit/net/fake_server.py";
            std::vector<std::string> words{"/usr/bin/python3", script, folder.string()};
            words.insert(words.end(), faults.begin(), faults.end());
            std::vector<char*> arguments;
            for (std::string& word : words)
                arguments.push_back(word.data());
            arguments.push_back(nullptr);
            execv(arguments[0], arguments.data());
            _exit(127);
        }
        close(in[0]);
        close(out[1]);
        to_child_ = in[1];
        FILE* said = fdopen(out[0], "r");
        if (fscanf(said, "%d", &port_) != 1)
            port_ = 0;
        fclose(said);
    }
    ~FakeServer() {
        close(to_child_);
        kill(child_, SIGKILL);
        waitpid(child_, nullptr, 0);
    }
    FakeServer(const FakeServer&) = delete;
    FakeServer& operator=(const FakeServer&) = delete;

    int port() const { return port_; }
    std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }
    NetServer server() const { return {url(), {}, {}, {}}; }
    void end() { kill(child_, SIGKILL); }

    // From now on, in place of those before.
    void set_faults(const std::vector<std::string>& faults) const {
        std::string lines;
        for (const std::string& fault : faults)
            lines += fault + "\n";
        const auto bytes = std::as_bytes(std::span(lines));
        if (!http({"PUT", url() + "/fake/faults", {}, bytes, {}}, {}))
            std::abort();
    }

    // "POST /claim 0 -": method, path, bytes of the body, key; a line each.
    std::string requests() const {
        std::ifstream in(folder_ / "requests");
        return {std::istreambuf_iterator<char>(in), {}};
    }

 private:
    std::filesystem::path folder_;
    pid_t child_ = -1;
    int to_child_ = -1, port_ = 0;
};

} // namespace palpate
