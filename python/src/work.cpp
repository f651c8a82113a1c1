#include "python/src/work.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <semaphore>
#include <thread>
#include <utility>
#include <vector>

#include "engine/base/log_sink.h"

namespace palpate::python {

namespace {

using namespace std::chrono_literals;

struct Messages {
    std::mutex mutex;
    std::vector<std::pair<log::Level, std::string>> waiting;
};
Messages& messages() {
    static auto* all = new Messages; // threads may write while the process ends
    return *all;
}

void keep_message(log::Level level, const std::string& message) noexcept try {
    const std::lock_guard lock(messages().mutex);
    messages().waiting.emplace_back(level, message);
} catch (const std::bad_alloc&) {
}

// May raise: warnings can be errors.
void hand_on_messages() {
    std::vector<std::pair<log::Level, std::string>> taken;
    {
        const std::lock_guard lock(messages().mutex);
        taken.swap(messages().waiting);
    }
    if (taken.empty())
        return;
    const py::module_ module = py::module_::import("palpate._messages");
    for (const auto& [level, text] : taken)
        module.attr("tell")(static_cast<int>(level), text);
}

// Threads that do the work of calls, each for one at a time. They stay for the next call: TBB keeps
// some kilobytes of every thread that it has ever served.
class Workers {
 public:
    void begin(std::function<void()> work) {
        Worker* worker = nullptr;
        {
            const std::lock_guard lock(mutex_);
            if (process_ != ::getpid()) { // a fork has none of the threads
                idle_.clear();
                process_ = ::getpid();
            }
            if (!idle_.empty()) {
                worker = idle_.back();
                idle_.pop_back();
            }
        }
        if (!worker) {
            worker = new Worker; // for as long as the process
            std::thread([this, worker] { serve(*worker); }).detach();
        }
        worker->work = std::move(work);
        worker->begun.release();
    }

 private:
    struct Worker {
        std::function<void()> work;
        std::binary_semaphore begun{0};
    };

    void serve(Worker& worker) {
        for (;;) {
            worker.begun.acquire();
            std::exchange(worker.work, nullptr)();
            const std::lock_guard lock(mutex_);
            idle_.push_back(&worker);
        }
    }

    std::mutex mutex_;
    pid_t process_ = ::getpid();
    std::vector<Worker*> idle_;
};
Workers& workers() {
    static auto* all = new Workers; // they wait while the process ends
    return *all;
}

// The state that a call and the thread that works for it share.
struct Turn {
    std::mutex mutex;
    std::condition_variable changed;
    bool ended = false;
    std::atomic<double> share = -1.0;
    std::exception_ptr thrown;
};

} // namespace

void take_messages() {
    log::set_sink(keep_message);
}

void run_aside(const py::object& progress, const std::function<void(const Report&)>& work) {
    const auto turn = std::make_shared<Turn>();
    std::exception_ptr raised; // by Python
    std::stop_source stop;
    // `work` is there until the turn has ended, which is waited for whatever Python raises.
    workers().begin([turn, &work, token = stop.get_token()] {
        try {
            work({token, [&](double done) { turn->share = done; }});
        } catch (...) {
            turn->thrown = std::current_exception();
        }
        const std::lock_guard lock(turn->mutex);
        turn->ended = true;
        turn->changed.notify_one();
    });
    for (double told = -1.0;;) {
        bool is_over = false;
        {
            const py::gil_scoped_release others_run;
            std::unique_lock lock(turn->mutex);
            is_over = turn->changed.wait_for(lock, 20ms, [&] { return turn->ended; });
        }
        if (is_over)
            break;
        if (raised)
            continue;
        try {
            if (PyErr_CheckSignals() != 0)
                throw py::error_already_set();
            if (const double done = turn->share; !progress.is_none() && done != told)
                progress(told = done);
        } catch (...) {
            raised = std::current_exception();
            stop.request_stop();
        }
    }
    if (raised)
        std::rethrow_exception(raised);
    if (turn->thrown) {
        try {
            std::rethrow_exception(turn->thrown);
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& error) {
            throw Failure(error.what());
        }
    }
    if (!progress.is_none())
        progress(1.0);
    hand_on_messages();
}

} // namespace palpate::python
