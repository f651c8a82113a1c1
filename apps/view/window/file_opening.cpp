#include "apps/view/window/file_opening.h"

#include <chrono>
#include <utility>

#include "engine/base/failure.h"

namespace palpate::view {

namespace {

template <class Opened>
std::optional<Result<Opened>> taken(std::future<Result<Opened>>& from) {
    if (!from.valid() || from.wait_for(std::chrono::seconds(0)) == std::future_status::timeout)
        return std::nullopt;
    return from.get();
}

} // namespace

template <class Opened>
std::future<Result<Opened>> FileOpening::start(const std::string& path, Read<Opened> read) {
    stop_ = std::stop_source();
    share_ = std::make_shared<std::atomic<double>>(0.0);
    return std::async(threaded_ ? std::launch::async : std::launch::deferred,
                      [read = std::move(read), path, stop = stop_.get_token(),
                       share = share_]() -> Result<Opened> {
                          return attempt(
                              path, [&] { return read(stop, [share](double s) { *share = s; }); });
                      });
}

void FileOpening::begin(const std::string& path, bool asks_series, Read<Source> read) {
    asks_series_ = asks_series;
    source_ = start(path, std::move(read));
}

void FileOpening::begin_beside(const std::string& path, bool labels, Read<FileBeside> read) {
    labels_ = labels;
    beside_ = start(path, std::move(read));
}

std::optional<Result<Source>> FileOpening::take() {
    return taken(source_);
}

std::optional<Result<FileBeside>> FileOpening::take_beside() {
    return taken(beside_);
}

} // namespace palpate::view
