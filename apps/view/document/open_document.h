#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/view/document/message.h"
#include "apps/view/document/notes_link.h"
#include "apps/view/document/opening.h"

namespace palpate::view {

// "CT 'head', 30 images of 512 x 512 axial"; without the description where names are hidden.
std::string series_text(const SeriesInfo& series, bool names_hidden);

// The readers' notes as one message: warnings first. If they are long, the first sentences, and how
// many more there are on standard error. The volume's path is replaced by its title, if it has one.
Message said_of(const LoadedScene& loaded, const std::string& path, const std::string& title);

// The document that is open: its session, its file, its volumes and notes as they are now, and the
// message that a person reads next. The parts of a window's work (work.h) reach it through this.
class OpenDocument {
 public:
    // Takes the session out of the source.
    OpenDocument(Source& source, glm::uvec2 window_px, double text_scale, bool threaded);

    static constexpr const char* kGrey = "volume";
    static constexpr const char* kLabels = "labels";
    static constexpr const char* kSeeds = "seeds"; // stroke_edit.h

    bool threaded() const { return threaded_; }
    Session& session() { return session_; }
    const Session& session() const { return session_; }
    const Subject& subject() const { return subject_; }
    NotesLink& notes() { return notes_; }
    StepsFile& steps_file() { return steps_file_; }

    const SceneFile& file() const { return file_; }
    const std::string& path() const { return file_.volume; } // of the volume
    const std::string& title() const { return title_; }      // the file's or the project's name
    void set_title(std::string title) { title_ = std::move(title); }
    const LoadedScene& loaded() const { return loaded_; }
    const std::vector<SeriesInfo>& series() const { return loaded_.series; }
    const std::string& unit() const { return unit_; } // of the values
    double zero_hu() const { return zero_hu_; }       // the value that stands for 0 HU in a CT

    void tell(Message message) { message_ = std::move(message); }
    void tell_also(const Message& message); // beside what is to be told already

    // The newest of what is edited.
    EditState edited() { return session_.state(); }
    Volume grey();
    // Before all steps that can be undone.
    Volume first_grey() { return first_grey_ ? *first_grey_ : grey(); }
    std::optional<Volume> labels(); // none: a project without a map
    std::optional<Volume> seeds();
    Volume labels_or_empty();
    bool has_labels();                               // any samples of a label
    std::string name_of_label(uint32_t label) const; // "7", or "7 kidney" where it has a name
    std::string locked_text(uint16_t label) const;   // "label 7 kidney is locked and stays"
    std::optional<double> label_sample_mm3();        // that a sample of labels stands for
    // "143 HU  label 7 kidney", and "(12, 40, 7)  143 HU  label 7 kidney"; empty outside the
    // volume.
    std::string values_at(glm::dvec3 point_mm);
    std::string text_at(glm::dvec3 point_mm);

    const std::string& grey_name() const { return grey_; }
    const std::string& labels_name() const { return labels_; }
    // What changes of labels leave as it was: locked labels, and what the mask of the window
    // closes.
    EditLimits limits();
    void set_mask(EditMask mask) { mask_ = std::move(mask); }
    // Labels become these within limits(), as one step (Editor::put()). False, as of all commands:
    // too many at once.
    bool put_labels(Volume labels, std::string step, Json parameters = Json::object(),
                    NotePages::Texts notes = {});
    // Empty ones, where there are none.
    bool make_labels();
    bool make_seeds();
    bool clear_seeds();
    // Labels of a file take the place of those that are there, as one step. On the volume's grid.
    void take_labels(LoadedVolume labels);

    // How another volume is shown over the slices, if no segmentation is seen there.
    const std::optional<FusionLayer>& fusion() const { return fusion_; }
    void show_fused(FusionLayer layer) { fusion_ = std::move(layer); }

 protected:
    Message message_;
    Subject subject_;

 private:
    std::optional<Volume> find(const std::string& volume);
    // The value of a sample at a point of the document; none outside, or without the volume.
    std::optional<float> value_at(const std::string& volume, glm::dvec3 point_mm);

    const bool threaded_;
    SceneFile file_;
    std::string title_;
    LoadedScene loaded_;
    std::string unit_;
    double zero_hu_;
    StepsFile steps_file_; // outlives the session
    Session session_;
    std::optional<Volume> first_grey_; // none: no steps came with the document
    NotesLink notes_;
    std::string grey_, labels_;
    EditMask mask_;
    std::optional<FusionLayer> fusion_;
};

// Whether a person has locked a label: no tool changes its samples, adds to it, or changes the grey
// values under it.
bool is_locked(const ViewState& state, uint16_t label);

} // namespace palpate::view
