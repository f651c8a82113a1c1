#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "engine/io/volume_io.h"

namespace palpate::view {

// Small pictures of the series of a DICOM folder, made one after the other on a thread of its own.
// They lie in one picture, kAcross beside each other. All members are for one thread.
class SeriesPreviews {
 public:
    static constexpr uint32_t kSide_px = 96, kAcross = 8;
    static constexpr size_t kMost = 64; // of later ones there are none
    // A series by its number, from 1: its middle image, or all of it.
    using Read = std::function<Result<LoadedVolume>(const std::string& path, uint32_t series,
                                                    const std::stop_token& stop)>;

    // threaded: false: they are there when the constructor returns.
    SeriesPreviews(Read read, std::string path, std::vector<uint32_t> numbers, bool threaded);
    // Makes the small picture of anything else: a kSide_px square of 4 bytes a pixel.
    using Make = std::function<Result<std::vector<std::byte>>(size_t i, const std::stop_token&)>;
    SeriesPreviews(Make make, size_t count, bool threaded);

    // Takes what has come since the last call: whether something has.
    bool poll();
    enum class State { waiting, there, none };
    State state(size_t i) const { return i < states_.size() ? states_[i] : State::none; }
    // The lower corner of one's picture; the sides are kSide_px.
    static glm::uvec2 corner_px(size_t i) {
        return kSide_px * glm::uvec2(i % kAcross, i / kAcross);
    }
    glm::uvec2 size_px() const;
    const std::vector<std::byte>& rgba() const { return rgba_; } // row 0 at the top

 private:
    struct Made {
        size_t i;
        std::vector<std::byte> rgba; // empty: none
    };
    void make_all(const std::stop_token& stop);

    Make make_;
    std::vector<State> states_;
    std::vector<std::byte> rgba_;
    std::mutex mutex_; // of made_
    std::vector<Made> made_;
    std::jthread thread_; // last: stops and ends before the rest goes
};

// The file that is pointed at in the chooser of files, and its picture.
struct FilePreview {
    std::string path;
    std::unique_ptr<SeriesPreviews> picture; // of one; null: none is made
};

// The middle slice of a volume as a square of 4 bytes a pixel (R, G, B, A), fitted by its size in
// mm and turned as the window's view of that plane is, axial ones with the patient's right at the
// left and the front above: a CT in its soft-tissue window, others between the 1st and the 99th
// percentile.
std::vector<std::byte> preview_of(const LoadedVolume& loaded, uint32_t side_px);

} // namespace palpate::view
