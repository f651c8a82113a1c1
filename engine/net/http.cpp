#include "engine/net/http.h"

#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <memory>
#include <optional>
#include <string_view>

#include "engine/base/printable.h"
#include "engine/net/curl_library.h"

namespace palpate {

namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kMostHeaderBytes = 256 << 10;

// One request while it runs; the callbacks fill it.
struct Transfer {
    const HttpRequest& request;
    HttpReply reply{};
    size_t header_bytes = 0;
    bool is_too_large = false;
};

size_t take_body(char* bytes, size_t, size_t count, void* into) {
    auto& transfer = *static_cast<Transfer*>(into);
    std::vector<std::byte>& body = transfer.reply.body;
    if (count > transfer.request.limits.reply_bytes - body.size()) {
        transfer.is_too_large = true;
        return 0;
    }
    const auto* first = reinterpret_cast<const std::byte*>(bytes);
    body.insert(body.end(), first, first + count);
    return count;
}

size_t take_header(char* bytes, size_t, size_t count, void* into) {
    auto& transfer = *static_cast<Transfer*>(into);
    std::string_view line(bytes, count);
    transfer.header_bytes += count;
    if (transfer.header_bytes > kMostHeaderBytes) {
        transfer.is_too_large = true;
        return 0;
    }
    if (line.starts_with("HTTP/"))
        transfer.reply.headers.clear(); // of an answer before this one, such as 100
    const size_t colon = line.find(':');
    if (colon == std::string_view::npos)
        return count;
    std::string name(line.substr(0, colon));
    for (char& c : name)
        c = char(std::tolower(static_cast<unsigned char>(c)));
    line.remove_prefix(colon + 1);
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.front())))
        line.remove_prefix(1);
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())))
        line.remove_suffix(1);
    transfer.reply.headers[name] = line;
    return count;
}

// Handles of libcurl, freed in the order that it wants.
struct Handles {
    const CurlLibrary& curl;
    CURL* easy;
    CURLM* multi;
    curl_slist* headers = nullptr;
    bool is_added = false;

    explicit Handles(const CurlLibrary& library)
        : curl(library), easy(library.easy_init()), multi(library.multi_init()) {}
    ~Handles() {
        if (is_added)
            curl.multi_remove_handle(multi, easy);
        curl.slist_free_all(headers);
        if (easy != nullptr)
            curl.easy_cleanup(easy);
        if (multi != nullptr)
            curl.multi_cleanup(multi);
    }
    Handles(const Handles&) = delete;
    Handles& operator=(const Handles&) = delete;
};

// While one lives, its thread takes no SIGPIPE: a server that closes a connection under TLS would
// end the program, as CURLOPT_NOSIGNAL leaves that signal to us.
class NoPipeSignal {
 public:
    NoPipeSignal() {
        sigset_t pending;
        sigemptyset(&pipe_);
        sigaddset(&pipe_, SIGPIPE);
        sigpending(&pending);
        was_pending_ = sigismember(&pending, SIGPIPE) == 1;
        pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
    }
    ~NoPipeSignal() {
        const timespec now{};
        while (!was_pending_ && sigtimedwait(&pipe_, nullptr, &now) == -1 && errno == EINTR) {
        }
        pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    }
    NoPipeSignal(const NoPipeSignal&) = delete;
    NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
    sigset_t pipe_, before_;
    bool was_pending_;
};

void set_options(Handles& h, Transfer& transfer) {
    const HttpRequest& request = transfer.request;
    const auto set = [&](CURLoption option, auto value) {
        h.curl.easy_setopt(h.easy, option, value);
    };
    set(CURLOPT_URL, request.url.c_str());
    set(CURLOPT_PROTOCOLS_STR, "http,https");
    set(CURLOPT_HTTP_VERSION, long{CURL_HTTP_VERSION_1_1});
    set(CURLOPT_FOLLOWLOCATION, 0L);
    set(CURLOPT_PROXY, "");
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_CONNECTTIMEOUT_MS, long(request.limits.connect.count()));
    set(CURLOPT_CUSTOMREQUEST, request.method.c_str());
    if (request.method != "GET" && request.method != "DELETE") {
        set(CURLOPT_POSTFIELDSIZE_LARGE, curl_off_t(request.body.size()));
        set(CURLOPT_POSTFIELDS,
            request.body.empty() ? "" : reinterpret_cast<const char*>(request.body.data()));
    }
    for (const auto& [name, value] : request.headers)
        h.headers = h.curl.slist_append(h.headers, (name + ": " + value).c_str());
    h.headers = h.curl.slist_append(h.headers, "Expect:"); // no question before a body
    set(CURLOPT_HTTPHEADER, h.headers);
    set(CURLOPT_HEADERFUNCTION, &take_header);
    set(CURLOPT_HEADERDATA, static_cast<void*>(&transfer));
    set(CURLOPT_WRITEFUNCTION, &take_body);
    set(CURLOPT_WRITEDATA, static_cast<void*>(&transfer));
}

double seconds(std::chrono::milliseconds time) {
    return double(time.count()) / 1000.0;
}

// The clocks of a transfer: silence, and the whole.
struct Watch {
    const HttpLimits& limits;
    Clock::time_point started = Clock::now(), moved = started;
    uint64_t bytes = 0;

    Result<void> look(const std::string& url, uint64_t bytes_now) {
        const Clock::time_point now = Clock::now();
        if (bytes_now != bytes) {
            bytes = bytes_now;
            moved = now;
        }
        if (now - moved > limits.quiet)
            return fail("{}: expected an answer, found silence for {:g} s", url,
                        seconds(limits.quiet));
        if (now - started > limits.whole)
            return fail("{}: expected a whole answer within {:g} s, found a part", url,
                        seconds(limits.whole));
        return {};
    }
};

Result<void> run(Handles& h, Transfer& transfer, const std::stop_token& stop) {
    const HttpRequest& request = transfer.request;
    const std::stop_callback wake(stop, [&] { h.curl.multi_wakeup(h.multi); });
    Watch watch{request.limits};
    std::optional<Clock::time_point> stopped;
    for (;;) {
        if (stop.stop_requested() && !stopped)
            stopped = Clock::now();
        if (stopped && Clock::now() - *stopped >= request.limits.after_stop)
            return fail("stopped before it was done");
        int running = 0;
        h.curl.multi_perform(h.multi, &running);
        if (running == 0)
            break;
        curl_off_t sent = 0;
        h.curl.easy_getinfo(h.easy, CURLINFO_SIZE_UPLOAD_T, &sent);
        PALPATE_TRY(watch.look(
            request.url, uint64_t(sent) + transfer.header_bytes + transfer.reply.body.size()));
        const auto least = std::min(request.limits.quiet, request.limits.whole) / 4;
        const int wait_ms = int(std::clamp<int64_t>(least.count(), 1, 250));
        h.curl.multi_poll(h.multi, nullptr, 0, wait_ms, nullptr);
    }
    if (transfer.is_too_large)
        return fail("{}: expected an answer of at most {} bytes, found more", request.url,
                    request.limits.reply_bytes);
    int left = 0;
    const CURLMsg* message = h.curl.multi_info_read(h.multi, &left);
    const CURLcode code = message ? message->data.result : CURLE_FAILED_INIT;
    if (code != CURLE_OK)
        return fail("{}: expected an answer, found: {}", request.url, h.curl.easy_strerror(code));
    return {};
}

} // namespace

Result<HttpReply> http(const HttpRequest& request, const std::stop_token& stop) {
    const Result<CurlLibrary>& library = curl_library();
    if (!library)
        return fail("{}", library.error().message);
    const NoPipeSignal no_signal;
    Handles handles(*library);
    if (handles.easy == nullptr || handles.multi == nullptr)
        return fail("{}: expected libcurl to start, found no memory", printable(request.url));
    Transfer transfer{request};
    set_options(handles, transfer);
    handles.curl.multi_add_handle(handles.multi, handles.easy);
    handles.is_added = true;
    PALPATE_TRY(run(handles, transfer, stop));
    long status = 0;
    handles.curl.easy_getinfo(handles.easy, CURLINFO_RESPONSE_CODE, &status);
    transfer.reply.status = int(status);
    return std::move(transfer.reply);
}

} // namespace palpate
