#include "engine/edit/history.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "engine/base/failure.h"
#include "engine/base/fd.h"
#include "engine/base/profile.h"
#include "engine/edit/step.h"

namespace palpate {

namespace {

// A file without a name: gone with the process, however that ends.
class SpillFile {
 public:
    // Returns the place of the bytes in the file; nothing where the folder takes none.
    std::optional<off_t> append(const std::filesystem::path& folder, std::string_view bytes) {
        if (!fd_)
            fd_ = Fd(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
        const off_t at = end_;
        if (!fd_ || !write_all_at(fd_, std::as_bytes(std::span(bytes)), at))
            return std::nullopt;
        end_ = at + static_cast<off_t>(bytes.size());
        return at;
    }
    Result<std::string> read(off_t at, size_t size) const {
        std::string bytes(size, '\0');
        for (size_t done = 0; done < size;) {
            const ssize_t n =
                ::pread(fd_.get(), bytes.data() + done, size - done, at + static_cast<off_t>(done));
            if (n < 0 && errno == EINTR)
                continue;
            if (n <= 0)
                return fail("history: a step on disk cannot be read back: {}",
                            n == 0 ? "the file ended" : std::strerror(errno));
            done += static_cast<size_t>(n);
        }
        return bytes;
    }
    void clear() {
        end_ = 0;
        if (fd_ && ::ftruncate(fd_.get(), 0) != 0)
            end_ = 0; // the space stays taken; nothing else depends on it
    }

 private:
    Fd fd_;
    off_t end_ = 0;
};

// A step in the form that it has at the moment: bricks, a packed difference, or a place on disk.
struct KeptStep {
    std::string title;
    bool empty = false; // of an edit that changed nothing
    Step open;
    std::string packed;
    std::optional<off_t> on_disk;
    size_t disk_bytes = 0;

    uint64_t bytes(bool to_undo) const {
        uint64_t sum = sizeof(KeptStep) + packed.size() + open.volumes.size() * sizeof(VolumeStep);
        for (const auto* notes : {&open.notes_before, &open.notes_after})
            for (const auto& [page, text] : *notes)
                sum += page.size() + text.size();
        for (const VolumeStep& part : open.volumes) {
            sum += part.bricks.size() * sizeof(ReplacedBrick);
            for (const ReplacedBrick& brick : part.bricks) // the other side is the present's or a
                sum += (to_undo ? brick.before : brick.after)->bytes(); // later step's
        }
        return sum;
    }
};

} // namespace

struct History::State {
    HistoryOptions options;
    mutable std::mutex mutex; // of everything below; held for no longer than a look
    std::condition_variable_any work, done;
    std::deque<std::shared_ptr<KeptStep>> undo,
        redo; // oldest first; the next to take is at the back
    std::deque<std::shared_ptr<KeptStep>> to_pack;
    std::shared_ptr<KeptStep> begun, looked_at;
    bool packing = false;
    SpillFile spill;
    bool spill_failed = false, pack_failed = false;
    size_t dropped = 0;
    std::vector<std::string> notices; // not told yet
    std::jthread worker;              // last: ends before the rest goes

    uint64_t bytes() const {
        uint64_t sum = 0;
        for (const auto& step : undo)
            sum += step->bytes(true);
        for (const auto& step : redo)
            sum += step->bytes(false);
        return sum;
    }

    void pack_steps(const std::stop_token& stop) {
        profile::name_thread("history");
        std::unique_lock lock(mutex);
        while (work.wait(lock, stop, [&] { return !to_pack.empty(); })) {
            const std::shared_ptr<KeptStep> step = std::move(to_pack.front());
            to_pack.pop_front();
            packing = true;
            std::string packed, failure;
            try {
                const profile::Scope scope("pack step");
                const Step open = step->open; // its bricks are shared
                lock.unlock();
                packed = pack_step(open);
            } catch (const std::exception& error) { // samples that cannot be read, say
                failure = failure_text(error);
            }
            if (!lock.owns_lock())
                lock.lock();
            if (!failure.empty() && !std::exchange(pack_failed, true))
                notices.push_back("history: a step stays unpacked in memory: " + failure);
            if (!packed.empty()) { // zstd had memory
                step->packed = std::move(packed);
                step->open = {};
            }
            packing = false;
            make_room();
            done.notify_all();
        }
    }

    // Until all fits, or nothing that is packed is left in memory. The present is worth most, then
    // what can be undone soonest.
    void make_room() {
        uint64_t sum = bytes();
        for (auto* stack : {&undo, &redo})
            for (size_t i = 0; i < stack->size() && sum > options.memory_bytes;) {
                KeptStep& step = *(*stack)[i];
                if (step.on_disk || step.packed.empty()) {
                    ++i;
                    continue;
                }
                if (!options.spill_folder.empty() && !spill_failed) {
                    step.on_disk = spill.append(options.spill_folder, step.packed);
                    if (step.on_disk) {
                        step.disk_bytes = step.packed.size();
                        sum -= step.disk_bytes;
                        step.packed = {};
                        ++i;
                        continue;
                    }
                    spill_failed = true;
                    notices.push_back(fmt::format(
                        "history: steps cannot be kept in {}; the oldest that do not fit in "
                        "memory are dropped",
                        options.spill_folder.string()));
                }
                // A step cannot be taken without those after it: all up to this one go.
                if (dropped == 0)
                    notices.push_back(fmt::format(
                        "history: steps need more than {:.1f} MiB; the oldest are dropped and "
                        "cannot be undone",
                        static_cast<double>(options.memory_bytes) / (1 << 20)));
                for (size_t k = 0; k <= i; ++k)
                    sum -= (*stack)[k]->bytes(stack == &undo);
                dropped += i + 1;
                stack->erase(stack->begin(), stack->begin() + static_cast<ptrdiff_t>(i) + 1);
                i = 0;
            }
        if (undo.empty() && redo.empty())
            spill.clear();
    }

    void tell() { // on the caller's thread, without the lock
        std::vector<std::string> now;
        {
            const std::lock_guard lock(mutex);
            now.swap(notices);
        }
        for (const std::string& notice : now)
            if (options.notice)
                options.notice(notice);
    }

    Result<std::optional<Document>> look(const Document& now, bool back) {
        const auto& from = back ? undo : redo;
        const std::unique_lock lock(mutex);
        if (from.empty())
            return std::optional<Document>();
        const std::shared_ptr<KeptStep> step = from.back();
        Result<Document> next = now; // and stays so where the edit changed nothing
        if (!step->open.empty()) {
            next = apply_step(now, step->open, back);
        } else if (step->on_disk) {
            PALPATE_TRY(const std::string read, spill.read(*step->on_disk, step->disk_bytes));
            next = apply_packed_step(now, read, back);
        } else if (!step->empty) {
            next = apply_packed_step(now, step->packed, back);
        }
        if (!next)
            return pass_on(next);
        looked_at = step;
        return std::optional<Document>(std::move(*next));
    }

    void move(bool back) {
        auto& from = back ? undo : redo;
        const std::unique_lock lock(mutex);
        (back ? redo : undo).push_back(looked_at);
        // The worker may have dropped it meanwhile, to make room.
        if (!from.empty() && from.back() == looked_at)
            from.pop_back();
        looked_at.reset();
    }
};

History::History(HistoryOptions options) : state_(std::make_unique<State>()) {
    state_->options = std::move(options);
    state_->worker = std::jthread(
        [state = state_.get()](const std::stop_token& stop) { state->pack_steps(stop); });
}

History::~History() = default;

void History::record(const Document& before, const Document& after, std::string title) {
    begin(before, after, std::move(title));
    end();
}

void History::begin(const Document& before, const Document& after, std::string title) {
    auto step = std::make_shared<KeptStep>();
    step->title = std::move(title);
    step->open = step_between(before, after);
    step->empty = step->open.empty();
    state_->begun = std::move(step);
}

void History::end() {
    const std::shared_ptr<KeptStep> step = std::move(state_->begun);
    {
        std::unique_lock lock(state_->mutex);
        state_->redo.clear();
        state_->undo.push_back(step);
        if (!step->empty)
            state_->to_pack.push_back(step);
        state_->work.notify_one();
        // The worker is behind, and memory is full of what it has not packed: wait for it.
        while (state_->bytes() > state_->options.memory_bytes &&
               (state_->packing || !state_->to_pack.empty()))
            state_->done.wait(lock);
    }
    state_->tell();
}

Result<std::optional<Document>> History::undo(const Document& now) {
    Result<std::optional<Document>> taken = look(now, true);
    if (taken && *taken)
        move(true);
    return taken;
}

Result<std::optional<Document>> History::redo(const Document& now) {
    Result<std::optional<Document>> taken = look(now, false);
    if (taken && *taken)
        move(false);
    return taken;
}

Result<std::optional<Document>> History::look(const Document& now, bool back) {
    return state_->look(now, back);
}

void History::move(bool back) {
    state_->move(back);
}

void History::forget_redo() {
    const std::lock_guard lock(state_->mutex);
    state_->redo.clear();
}

std::vector<History::PackedStep> History::newest(uint64_t most_bytes) const {
    std::vector<PackedStep> steps;
    std::vector<Step> open; // of those that are not packed: their bricks are shared
    {
        const std::lock_guard lock(state_->mutex);
        for (auto step = state_->undo.rbegin(); step != state_->undo.rend(); ++step) {
            if ((*step)->on_disk)
                break;
            steps.push_back({(*step)->title, (*step)->packed});
            open.push_back((*step)->open);
        }
    }
    uint64_t bytes = 0;
    for (size_t i = 0; i < steps.size(); ++i) {
        if (steps[i].packed.empty())
            try {
                steps[i].packed = pack_step(open[i]);
            } catch (const std::exception&) { // samples that cannot be read: none from there on
            }
        bytes += steps[i].packed.size();
        if (bytes > most_bytes || steps[i].packed.empty())
            steps.resize(i);
    }
    std::reverse(steps.begin(), steps.end());
    return steps;
}

void History::add_before(PackedStep step) {
    auto kept = std::make_shared<KeptStep>();
    kept->title = std::move(step.title);
    kept->packed = std::move(step.packed);
    const std::lock_guard lock(state_->mutex);
    state_->undo.push_front(std::move(kept));
}

std::vector<std::string> History::titles() const {
    const std::lock_guard lock(state_->mutex);
    std::vector<std::string> titles;
    for (const auto& step : state_->undo)
        titles.push_back(step->title);
    for (auto step = state_->redo.rbegin(); step != state_->redo.rend(); ++step)
        titles.push_back((*step)->title);
    return titles;
}

History::Stats History::stats() const {
    const std::lock_guard lock(state_->mutex);
    Stats stats;
    stats.undo_steps = state_->undo.size();
    stats.redo_steps = state_->redo.size();
    for (const auto* stack : {&state_->undo, &state_->redo})
        for (const auto& step : *stack) {
            stats.packed_steps += !step->packed.empty();
            stats.spilled_steps += step->on_disk.has_value();
            stats.spilled_bytes += step->disk_bytes;
        }
    stats.dropped_steps = state_->dropped;
    stats.memory_bytes = state_->bytes();
    if (!state_->undo.empty())
        stats.newest_bytes = state_->undo.back()->bytes(true);
    return stats;
}

void History::settle() {
    {
        std::unique_lock lock(state_->mutex);
        state_->done.wait(lock, [&] { return !state_->packing && state_->to_pack.empty(); });
    }
    state_->tell();
}

} // namespace palpate
