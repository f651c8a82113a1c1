#include "engine/edit/history.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "engine/base/profile.h"
#include "engine/edit/step.h"

namespace palpate {

namespace {

// A file without a name: gone with the process, however that ends.
class SpillFile {
 public:
    ~SpillFile() {
        if (fd_ >= 0)
            ::close(fd_);
    }
    // Where the bytes lie; nothing where the folder takes none.
    std::optional<off_t> append(const std::filesystem::path& folder,
                                std::span<const std::byte> bytes) {
        if (fd_ < 0)
            fd_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
        if (fd_ < 0)
            return std::nullopt;
        const off_t at = end_;
        for (size_t done = 0; done < bytes.size();) {
            const ssize_t n = ::pwrite(fd_, bytes.data() + done, bytes.size() - done,
                                       at + static_cast<off_t>(done));
            if (n < 0 && errno == EINTR)
                continue;
            if (n <= 0)
                return std::nullopt;
            done += static_cast<size_t>(n);
        }
        end_ = at + static_cast<off_t>(bytes.size());
        return at;
    }
    Result<std::vector<std::byte>> read(off_t at, size_t size) const {
        std::vector<std::byte> bytes(size);
        for (size_t done = 0; done < size;) {
            const ssize_t n =
                ::pread(fd_, bytes.data() + done, size - done, at + static_cast<off_t>(done));
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
        if (fd_ >= 0 && ::ftruncate(fd_, 0) != 0)
            end_ = 0; // the space stays taken; nothing else depends on it
    }

 private:
    int fd_ = -1;
    off_t end_ = 0;
};

// What a step is at the moment: bricks, a packed difference, or a place on disk.
struct Step {
    bool empty = false; // of an edit that changed nothing
    std::vector<ReplacedBrick> bricks;
    std::vector<std::byte> packed;
    std::optional<off_t> on_disk;
    size_t disk_bytes = 0;

    uint64_t bytes(bool to_undo) const {
        uint64_t sum = sizeof(Step) + packed.size() + bricks.size() * sizeof(ReplacedBrick);
        for (const ReplacedBrick& brick :
             bricks) // the other side is the present's or a later step's
            sum += (to_undo ? brick.before : brick.after)->bytes();
        return sum;
    }
};

} // namespace

struct History::State {
    HistoryOptions options;
    mutable std::mutex mutex; // of everything below; held for no longer than a look
    std::condition_variable_any work, done;
    std::deque<std::shared_ptr<Step>> undo, redo; // oldest first; the next to take is at the back
    std::deque<std::pair<std::shared_ptr<Step>, Volume>> to_pack;
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
            const auto [step, of] = std::move(to_pack.front());
            to_pack.pop_front();
            packing = true;
            const std::vector<ReplacedBrick> bricks = step->bricks; // shared with the step
            lock.unlock();
            std::vector<std::byte> packed;
            std::string failure;
            try {
                const profile::Scope scope("pack step");
                packed = pack_step(of, bricks);
            } catch (const std::exception& error) { // samples that cannot be read, say
                failure = error.what();
            }
            lock.lock();
            if (!failure.empty() && !std::exchange(pack_failed, true))
                notices.push_back("history: a step stays unpacked in memory: " + failure);
            if (!packed.empty()) { // zstd had memory
                step->packed = std::move(packed);
                step->bricks.clear();
                step->bricks.shrink_to_fit();
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
                Step& step = *(*stack)[i];
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

    Result<std::optional<Volume>> take(const Volume& now, bool back) {
        auto& from = back ? undo : redo;
        auto& to = back ? redo : undo;
        std::unique_lock lock(mutex);
        if (from.empty())
            return std::optional<Volume>();
        const std::shared_ptr<Step> step = from.back();
        Volume next = now; // and stays so where the edit changed nothing
        if (!step->bricks.empty()) {
            std::vector<PlacedBrick> bricks;
            for (const ReplacedBrick& brick : step->bricks)
                bricks.push_back({brick.where.position, back ? brick.before : brick.after});
            next = with_bricks(now, bricks);
        } else if (!step->empty) {
            std::vector<std::byte> read;
            if (step->on_disk) {
                Result<std::vector<std::byte>> found = spill.read(*step->on_disk, step->disk_bytes);
                if (!found)
                    return pass_on(found);
                read = std::move(*found);
            }
            Result<Volume> taken = apply_packed_step(now, step->on_disk ? read : step->packed);
            if (!taken)
                return pass_on(taken);
            next = *taken;
        }
        from.pop_back();
        to.push_back(step);
        return std::optional<Volume>(next);
    }
};

History::History(HistoryOptions options) : state_(std::make_unique<State>()) {
    state_->options = std::move(options);
    state_->worker = std::jthread(
        [state = state_.get()](const std::stop_token& stop) { state->pack_steps(stop); });
}

History::~History() = default;

void History::record(const Volume& before, const Volume& after) {
    auto step = std::make_shared<Step>();
    step->bricks = replaced_bricks(before, after);
    step->empty = step->bricks.empty();
    {
        std::unique_lock lock(state_->mutex);
        state_->redo.clear();
        state_->undo.push_back(step);
        if (!step->empty)
            state_->to_pack.emplace_back(step, after);
        state_->work.notify_one();
        // The worker is behind, and memory is full of what it has not packed: wait for it.
        while (state_->bytes() > state_->options.memory_bytes &&
               (state_->packing || !state_->to_pack.empty()))
            state_->done.wait(lock);
    }
    state_->tell();
}

Result<std::optional<Volume>> History::undo(const Volume& now) {
    return state_->take(now, true);
}

Result<std::optional<Volume>> History::redo(const Volume& now) {
    return state_->take(now, false);
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
