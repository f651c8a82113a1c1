#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "engine/edit/history.h"
#include "engine/edit/journal.h"
#include "engine/scene/scene.h"

namespace palpate::view {

// Steps of a document that is no project yet, kept on disk so that none is lost where the program
// ends without a word.
//
// They are a journal in a folder of the program, named by a hash of what the document was when it
// was opened: they come back with the same samples, under whatever name, and with no others. A
// document that other windows have open, too, has a journal for each.
struct KeptSteps {
    Document document; // what was opened, with the steps that came back
    std::unique_ptr<History> history;
    std::optional<Journal> journal; // to go on with; none: why not is in `note`
    std::filesystem::path path;     // of it
    size_t recovered = 0;           // steps that came back, and are in effect
    std::string note;               // for people; empty: nothing is to be told
};

// Makes what a window opens: grey values, labels (empty ones where there are none) and seeds.
Document fresh_document(const SceneData& data);

// Keeps the steps of a fresh document. There is no journal where the folder cannot be written, and
// where the document's samples are more than kMostKept_bytes, which it would read all.
constexpr uint64_t kMostKept_bytes = uint64_t{4} << 30;
KeptSteps keep_steps(Document document, const std::filesystem::path& folder,
                     const std::stop_token& stop = {});

// The file of a journal, which outlives the session that writes it.
class StepsFile {
 public:
    StepsFile() = default;
    StepsFile(std::filesystem::path path, size_t recovered)
        : path_(std::move(path)), recovered_(recovered) {}
    ~StepsFile();
    StepsFile(const StepsFile&) = delete;
    StepsFile& operator=(const StepsFile&) = delete;

    size_t recovered() const { return recovered_; } // KeptSteps::recovered

    void discard();                // now: it is written no more
    void drop() { drops_ = true; } // at the end: a person wants its steps no more

 private:
    std::filesystem::path path_;
    size_t recovered_ = 0;
    bool drops_ = false;
};

} // namespace palpate::view
