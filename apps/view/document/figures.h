#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "engine/measure/histogram.h"
#include "engine/measure/label_statistics.h"
#include "engine/measure/measure.h"

namespace palpate::view {

// Numbers about the document that take longer than a frame: made on a thread of their own, the
// newest wish first, or at once in scripts.
class Figures {
 public:
    struct Wish {
        Volume grey;
        Volume counted; // for the histogram: grey, or a coarser level of what is very large
        std::optional<Volume> labels;
        std::vector<Measure> measures;
        bool label_statistics = false;

        bool is_same_as(const Wish& other) const;
    };
    // The known figures; some may be about an older wish than others, until all is done.
    struct Known {
        std::vector<std::pair<Measure, Measured>> measured;
        std::vector<uint64_t> label_counts; // by label, up to the highest that occurs
        double low = 0.0, high = 1.0;       // of the histogram
        std::vector<uint64_t> histogram;
        std::vector<LabelStatistics> labels;
        uint64_t labels_version = 0, grey_version = 0; // that `labels` are about
    };

    explicit Figures(bool threaded);
    ~Figures();
    Figures(const Figures&) = delete;
    Figures& operator=(const Figures&) = delete;

    void want(Wish wish);                 // cheap where it is the same as before
    std::shared_ptr<const Known> known(); // never null

 private:
    void run(const std::stop_token& stop);
    void begin_again();
    void make(const Wish& wish, const std::stop_token& slow, const std::stop_token& quit);
    void tell(const Known& known);

    const bool threaded_;
    // The maker's own.
    std::optional<palpate::Histogram> histogram_, label_counts_;
    Known made_;
    uint64_t measured_version_ = 0; // of the grey volume that made_.measured is about

    std::mutex mutex_; // of what follows
    std::condition_variable_any wake_;
    std::optional<Wish> wish_;
    bool is_new_ = false;
    std::stop_source slow_; // ends what a newer wish makes idle
    std::shared_ptr<const Known> known_ = std::make_shared<Known>();
    std::jthread thread_; // last: ends before the rest goes
};

} // namespace palpate::view
