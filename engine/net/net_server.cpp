#include "engine/net/net_server.h"

#include <algorithm>

#include "engine/base/printable.h"
#include "engine/net/bytes.h"

namespace palpate {

namespace {

bool is_plain(std::string_view text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 127; });
}

// A server's words on its failure: {"detail": "..."}, in at most 200 letters.
std::string detail_of(const HttpReply& reply) {
    const Result<Json> json = parse_json(text_of(reply.body), "answer");
    if (!json || !json->find("detail") || (*json)["detail"].kind != Json::Kind::string)
        return "";
    return ": " + printable(std::string_view((*json)["detail"].string).substr(0, 200));
}

std::string meaning_of(int status) {
    switch (status) {
        case 401:
        case 403:
            return "the server wants another key";
        case 404:
            return "the server does not know this";
        case 410:
            return "the lease has ended; connect again";
        case 413:
            return "the volume is too large for the server";
        case 503:
            return "the server is full; try again later";
        default:
            if (status >= 300 && status < 400)
                return "the server points elsewhere, which is not followed";
            return status >= 500 ? "the server has failed" : "the server refuses";
    }
}

} // namespace

Result<std::string> server_url(std::string_view text) {
    if (text.find('@') != std::string_view::npos) // which is not printed: it may be a password
        return fail(
            "expected a server such as gpu.example:1527 without a user or a password, "
            "found an @: a key comes from a file");
    std::string url(text);
    const size_t scheme = url.find("://");
    if (scheme == std::string::npos)
        url = "http://" + url;
    while (url.ends_with('/'))
        url.pop_back();
    const size_t host = url.find("://") + 3;
    const bool is_http = url.starts_with("http://") || url.starts_with("https://");
    if (!is_http || host >= url.size() || !is_plain(url) ||
        url.find_first_of("?#\\\"<>") != std::string::npos || url[host] == ':' ||
        url[host] == '/' || url[host] == '-')
        return fail("expected a server such as gpu.example:1527 or https://gpu.example, found {}",
                    printable(text));
    return url;
}

Result<std::string> server_key(std::string_view text) {
    std::string key(text.substr(0, std::min(text.find_first_of("\r\n"), text.size())));
    if (key.empty() || !is_plain(key))
        return fail("expected a key of letters and digits in the first line, found none");
    return key;
}

Result<HttpReply> ask(const NetServer& server, const NetQuestion& question,
                      const std::stop_token& stop, int* status) {
    HttpRequest request{
        question.method, server.url + question.path, {}, question.body, server.limits};
    request.limits.whole = std::max(request.limits.whole, request.limits.quiet);
    if (!server.key.empty())
        request.headers.emplace_back("Authorization", "Bearer " + server.key);
    if (!server.lease.empty())
        request.headers.emplace_back("X-Lease-Token", server.lease);
    if (!question.content_type.empty())
        request.headers.emplace_back("Content-Type", question.content_type);
    if (!question.meta.empty())
        request.headers.emplace_back("X-Meta", question.meta);
    PALPATE_TRY(HttpReply reply, http(request, stop));
    if (status != nullptr)
        *status = reply.status;
    if (reply.status < 200 || reply.status > 299)
        return fail("{}: {} ({}{})", request.url, meaning_of(reply.status), reply.status,
                    detail_of(reply));
    return reply;
}

Result<Json> json_of(const NetServer& server, const HttpReply& reply) {
    return parse_json(text_of(reply.body), server.url);
}

} // namespace palpate
