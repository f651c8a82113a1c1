#include "apps/view/document/figures.h"

#include "engine/base/failure.h"
#include "engine/base/profile.h"

namespace palpate::view {

namespace {
constexpr size_t kBins = 512;
} // namespace

bool Figures::Wish::is_same_as(const Wish& other) const {
    return grey.is_same_as(other.grey) && counted.is_same_as(other.counted) &&
           labels.has_value() == other.labels.has_value() &&
           (!labels || labels->is_same_as(*other.labels)) && measures == other.measures &&
           label_statistics == other.label_statistics;
}

Figures::Figures(bool threaded) : threaded_(threaded) {
    if (threaded)
        thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Figures::~Figures() {
    if (!thread_.joinable())
        return;
    thread_.request_stop();
    {
        const std::scoped_lock held(mutex_);
        slow_.request_stop();
    }
    thread_.join();
}

void Figures::want(Wish wish) {
    {
        const std::scoped_lock held(mutex_);
        if (wish_ && wish_->is_same_as(wish))
            return;
        wish_ = std::move(wish);
        is_new_ = true;
        slow_.request_stop();
        wake_.notify_one();
    }
    if (threaded_)
        return;
    try {
        make(*wish_, {}, {});
    } catch (const std::exception&) {
        begin_again();
        wish_.reset();
        throw;
    }
}

// Counts that were broken off are of no volume.
void Figures::begin_again() {
    label_counts_.reset();
    histogram_.reset();
}

std::shared_ptr<const Figures::Known> Figures::known() {
    const std::scoped_lock held(mutex_);
    return known_;
}

void Figures::run(const std::stop_token& stop) {
    profile::name_thread("figures");
    while (!stop.stop_requested()) {
        std::optional<Wish> wish;
        std::stop_token slow;
        {
            std::unique_lock held(mutex_);
            if (!wake_.wait(held, stop, [&] { return is_new_; }))
                return;
            is_new_ = false;
            wish = wish_;
            slow_ = std::stop_source();
            slow = slow_.get_token();
        }
        try {
            make(*wish, slow, stop);
        } catch (const std::exception& error) { // samples that cannot be read: the picture says it
            begin_again();
            constexpr std::chrono::milliseconds kAgain(100);
            std::unique_lock held(mutex_);
            if (is_lack_of_memory(error)) // else it would be the same again
                is_new_ = !wake_.wait_for(held, stop, kAgain, [&] { return is_new_; }) || is_new_;
        }
    }
}

void Figures::tell(const Known& known) {
    auto copy = std::make_shared<const Known>(known);
    const std::scoped_lock held(mutex_);
    known_ = std::move(copy);
}

// `slow` is asked to stop when there is a newer wish. Counts go on where they were: an edit costs
// little.
void Figures::make(const Wish& wish, const std::stop_token& slow, const std::stop_token& quit) {
    const uint64_t version = wish.grey.version();
    std::vector<std::pair<Measure, Measured>> measured;
    for (const Measure& one : wish.measures) {
        bool is_known = false;
        if (measured_version_ == version)
            for (const auto& before : made_.measured)
                if (!is_known && before.first == one) {
                    measured.push_back(before);
                    is_known = true;
                }
        if (is_known)
            continue;
        std::optional<Measured> now = measure(one, wish.grey, slow);
        if (!now)
            return;
        measured.emplace_back(one, std::move(*now));
    }
    made_.measured = std::move(measured);
    measured_version_ = version;
    tell(made_);

    made_.label_counts.clear();
    if (wish.labels) {
        if (!label_counts_)
            label_counts_.emplace(Histogram::of_labels());
        if (!label_counts_->count(*wish.labels, quit))
            return;
        made_.label_counts = label_counts_->counts();
        while (!made_.label_counts.empty() && made_.label_counts.back() == 0)
            made_.label_counts.pop_back();
    }
    tell(made_);

    if (!histogram_) {
        const ValueRange range = wish.grey.range();
        const double low = range.empty() ? 0.0 : double{range.min};
        histogram_.emplace(
            low, range.empty() || !(range.min < range.max) ? low + 1.0 : double{range.max}, kBins);
    }
    if (!histogram_->count(wish.counted, quit))
        return;
    made_.low = histogram_->low();
    made_.high = histogram_->high();
    made_.histogram = histogram_->counts();
    tell(made_);

    if (!wish.label_statistics || !wish.labels ||
        (made_.labels_version == wish.labels->version() && made_.grey_version == version))
        return;
    auto labels = label_statistics(*wish.labels, &wish.grey, slow);
    if (!labels)
        return;
    made_.labels = std::move(*labels);
    made_.labels_version = wish.labels->version();
    made_.grey_version = version;
    tell(made_);
}

} // namespace palpate::view
