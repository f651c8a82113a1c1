#pragma once

#include <span>
#include <stop_token>
#include <string>
#include <string_view>

#include "engine/base/json.h"
#include "engine/net/http.h"

namespace palpate {

// A server with a net, as a person names it.
struct NetServer {
    std::string url;     // as of server_url()
    std::string key;     // sent as "Authorization: Bearer KEY"; "": none
    HttpLimits limits{}; // of each request; the whole may take as long as silence, at least
    std::string lease{}; // of nnInteractive, sent as X-Lease-Token; "": none
};

// "host", "host:port", or a URL of http or https, without a slash at its end. Refused: other
// protocols, a user or a password in it, questions and fragments, spaces and control characters.
Result<std::string> server_url(std::string_view text);

// A key as it stands in a file: the first line. Refused: none, and letters that no header holds.
Result<std::string> server_key(std::string_view text);

// A question to a server.
struct NetQuestion {
    std::string method = "GET";
    std::string path; // from "/" on
    std::string content_type{};
    std::span<const std::byte> body{};
    std::string meta{}; // the header X-Meta; "": none
};

// The answer where its status is 200 .. 299. Else a sentence that names the server, the status, and
// what the server says of it: 401 and 403 a key, 410 an ended lease, 503 a full server. `status` is
// set where there is an answer.
Result<HttpReply> ask(const NetServer& server, const NetQuestion& question,
                      const std::stop_token& stop, int* status = nullptr);

// The body of an answer as JSON.
Result<Json> json_of(const NetServer& server, const HttpReply& reply);

} // namespace palpate
