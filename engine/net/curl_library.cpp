#include "engine/net/curl_library.h"

#include <dlfcn.h>

namespace palpate {

namespace {

constexpr const char* kName = "libcurl.so.4";

Result<CurlLibrary> open_library() {
    void* library = dlopen(kName, RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr)
        return fail("{}: expected the library (Debian: libcurl4), found: {}", kName, dlerror());
    CurlLibrary curl{};
    const char* missing = nullptr;
    const auto take = [&]<class Function>(Function& function, const char* name) {
        function = reinterpret_cast<Function>(dlsym(library, name));
        if (function == nullptr)
            missing = name;
    };
    take(curl.global_init, "curl_global_init");
    take(curl.easy_init, "curl_easy_init");
    take(curl.easy_setopt, "curl_easy_setopt");
    take(curl.easy_getinfo, "curl_easy_getinfo");
    take(curl.easy_strerror, "curl_easy_strerror");
    take(curl.easy_cleanup, "curl_easy_cleanup");
    take(curl.slist_append, "curl_slist_append");
    take(curl.slist_free_all, "curl_slist_free_all");
    take(curl.multi_init, "curl_multi_init");
    take(curl.multi_add_handle, "curl_multi_add_handle");
    take(curl.multi_remove_handle, "curl_multi_remove_handle");
    take(curl.multi_perform, "curl_multi_perform");
    take(curl.multi_poll, "curl_multi_poll");
    take(curl.multi_wakeup, "curl_multi_wakeup");
    take(curl.multi_info_read, "curl_multi_info_read");
    take(curl.multi_cleanup, "curl_multi_cleanup");
    if (missing != nullptr)
        return fail("{}: expected libcurl 7.85 or later, found none with {}", kName, missing);
    if (const CURLcode code = curl.global_init(CURL_GLOBAL_DEFAULT); code != CURLE_OK)
        return fail("{}: expected to start, found: {}", kName, curl.easy_strerror(code));
    return curl; // stays open: TLS libraries do not like to be unloaded
}

} // namespace

const Result<CurlLibrary>& curl_library() {
    static const Result<CurlLibrary> library = open_library();
    return library;
}

} // namespace palpate
