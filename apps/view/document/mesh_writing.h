#pragma once

#include <atomic>
#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "apps/view/document/open_document.h"
#include "engine/program/mesh_export.h"

namespace palpate::view {

// Writes surfaces of a document to files for print, on a thread of its own, one at a time.
class MeshWriting {
 public:
    explicit MeshWriting(OpenDocument& document) : document_(document) {}
    ~MeshWriting() { stop_.request_stop(); }

    // As the document is when strokes under way are done; to another name where the file is there.
    void begin(const MeshExport& wanted, const std::string& path);
    void stop() { stop_.request_stop(); }
    void poll(); // for each frame

    struct Share {
        const char* what = ""; // that is done now
        double share = 0.0;    // of all of it
    };
    std::optional<Share> share() const;           // nothing: no file is being made
    const Message& last() const { return last_; } // what the last file has come to

 private:
    struct Now {
        std::atomic<const char*> what{""};
        std::atomic<double> share{0.0};
    };
    OpenDocument& document_;
    Message last_;
    std::stop_source stop_;
    std::shared_ptr<Now> now_;
    std::future<Result<std::string>> done_; // last: its thread ends before the rest goes
};

} // namespace palpate::view
