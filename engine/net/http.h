#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// How long one request may take, and how much may come back.
struct HttpLimits {
    std::chrono::milliseconds connect{10'000}; // until there is a connection
    std::chrono::milliseconds quiet{60'000};   // without a byte in either direction
    std::chrono::milliseconds whole{1'800'000};
    std::chrono::milliseconds after_stop{0}; // in which an answer still counts
    uint64_t reply_bytes = 4 << 20;          // of the body
};

struct HttpRequest {
    std::string method = "GET";
    std::string url; // http:// or https://
    std::vector<std::pair<std::string, std::string>> headers;
    std::span<const std::byte> body;
    HttpLimits limits;
};

struct HttpReply {
    int status = 0;
    std::map<std::string, std::string> headers; // names in small letters
    std::vector<std::byte> body;
};

// One request over HTTP 1.1, whatever the status of its reply; TLS certificates are checked. It
// goes to the host of the URL and nowhere else: no redirection is followed, no proxy of the
// environment is asked. Refused, in a sentence that names the URL: no connection, a broken one, a
// limit that is passed, a library libcurl that is missing. A stop ends it at once,
// or `after_stop` later.
// From any thread, several at a time.
Result<HttpReply> http(const HttpRequest& request, const std::stop_token& stop);

} // namespace palpate
