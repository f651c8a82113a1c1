#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "apps/view/document/opening.h"
#include "engine/io/volume_io.h"

namespace palpate::view {

// A file that was read to lie beside the volume that is open.
struct FileBeside {
    LoadedVolume read;
    bool is_labels = false; // on the volume's grid; else another volume
};

// One file that is being read, to be opened or to lie beside the volume that is open: on a thread
// of its own, or, where nothing is threaded, once its result is taken.
class FileOpening {
 public:
    template <class Opened>
    using Read = std::function<Result<Opened>(const std::stop_token& stop,
                                              const std::function<void(double share)>& progress)>;

    explicit FileOpening(bool threaded) : threaded_(threaded) {}

    // While nothing is under way. `path` is for errors; `asks_series`: a person has not chosen one.
    void begin(const std::string& path, bool asks_series, Read<Source> read);
    void begin_beside(const std::string& path, bool labels, Read<FileBeside> read);
    bool is_under_way() const { return source_.valid() || beside_.valid(); }
    double share() const { return share_ ? share_->load() : 0.0; } // that is read, 0 .. 1
    void cancel() { stop_.request_stop(); }
    bool is_cancelled() const { return stop_.stop_requested(); }
    bool asks_series() const { return asks_series_; }
    bool is_of_labels() const { return labels_; }

    // The result of reading, once it is there, and once.
    std::optional<Result<Source>> take();
    std::optional<Result<FileBeside>> take_beside();

 private:
    template <class Opened>
    std::future<Result<Opened>> start(const std::string& path, Read<Opened> read);

    bool threaded_, asks_series_ = false, labels_ = false;
    std::stop_source stop_;
    std::shared_ptr<std::atomic<double>> share_;
    // Last: their threads end before the rest goes.
    std::future<Result<Source>> source_;
    std::future<Result<FileBeside>> beside_;
};

} // namespace palpate::view
