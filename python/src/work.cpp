#include "python/src/work.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
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

} // namespace

void take_messages() {
    log::set_sink(keep_message);
}

void run_aside(const py::object& progress, const std::function<void(const Report&)>& work) {
    std::mutex mutex;
    std::condition_variable changed;
    bool ended = false;
    std::atomic<double> share = -1.0;
    std::exception_ptr thrown;
    std::optional<py::error_already_set> raised;
    {
        std::stop_source stop;
        const std::jthread worker([&] {
            try {
                work({stop.get_token(), [&](double done) { share = done; }});
            } catch (...) {
                thrown = std::current_exception();
            }
            const std::lock_guard lock(mutex);
            ended = true;
            changed.notify_one();
        });
        for (double told = -1.0;;) {
            bool is_over = false;
            {
                const py::gil_scoped_release others_run;
                std::unique_lock lock(mutex);
                is_over = changed.wait_for(lock, 20ms, [&] { return ended; });
            }
            if (is_over)
                break;
            if (raised)
                continue;
            try {
                if (PyErr_CheckSignals() != 0)
                    throw py::error_already_set();
                if (const double done = share; !progress.is_none() && done != told)
                    progress(told = done);
            } catch (py::error_already_set& error) {
                raised = error;
                stop.request_stop();
            }
        }
    }
    if (raised)
        throw py::error_already_set(*raised);
    if (thrown) {
        try {
            std::rethrow_exception(thrown);
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
