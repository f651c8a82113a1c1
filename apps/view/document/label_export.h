#pragma once

#include <filesystem>
#include <future>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/view/document/open_document.h"

namespace palpate::view {

// The DICOM series that a document's volume was read from: its file or folder, and its UID where
// that holds several.
struct LabelSeries {
    std::filesystem::path path;
    std::string uid;
};

// Writes labels as a file of the kind that its name says: a volume with all of them, with the names
// and colours of labels where it has a place for them (save_labels()), or, of a mesh
// (.ply, .stl, .obj, .vtp), the surface of one label, smoothed within 0.375 of a sample
// (surface_nets()). A name that ends in .dcm stands for a DICOM segmentation of the series `of`,
// one that ends in rtstruct.dcm for a structure set of it. Says what was written. An error where no
// sample has the label, or the file cannot be written; then there is none.
Result<std::string> export_labels(const Volume& labels, uint16_t label,
                                  const std::filesystem::path& path, const std::stop_token& stop,
                                  const std::vector<LabelName>& names = {},
                                  const LabelSeries& of = {});

// The surface of each label in a file of its own, beside each other: "organs.stl" becomes
// "organs-liver.stl", of a label without a name "organs-7.stl". A name that is there is numbered.
Result<std::string> export_each_label(const Volume& labels, const std::filesystem::path& path,
                                      const std::stop_token& stop,
                                      const std::vector<LabelName>& names = {});

// Exports of a document's labels, on a thread of its own, one at a time.
class LabelExport {
 public:
    explicit LabelExport(OpenDocument& document) : document_(document) {}
    ~LabelExport() { stop_.request_stop(); }

    // As the labels are when strokes under way are done; to another name where the file is there.
    // each: surfaces of all labels, by export_each_label().
    void begin(uint16_t label, const std::string& path, bool each = false);
    bool is_writing() const { return done_.valid(); }
    void poll();                                  // for each frame
    const Message& last() const { return last_; } // what the last one has come to

 private:
    OpenDocument& document_;
    Message last_;
    std::stop_source stop_;
    std::future<Result<std::string>> done_; // last: its thread ends before the rest goes
};

} // namespace palpate::view
