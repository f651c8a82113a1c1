#include "haptics/servo/servo_thread.h"

#include <sched.h>
#include <string.h>
#include <sys/mman.h>

#include <thread>

#include "engine/base/assert.h"
#include "haptics/servo/pace.h"

namespace palpate::haptics {

namespace {

// Writes to every page below, so that none is new when a tick needs it.
[[gnu::noinline]] void touch_stack(size_t bytes) {
    volatile char* pages = static_cast<char*>(__builtin_alloca(bytes));
    for (size_t at = 0; at < bytes; at += 4096)
        pages[at] = 0;
}

} // namespace

void ServoThread::lock(std::span<const std::byte> memory, const char* what) {
    if (memory.empty())
        return;
    if (mlock(memory.data(), memory.size()) == 0) {
        locked_.push_back(memory);
        return;
    }
    state_.locked = false;
    state_.why += fmt::format("{}{}: {} bytes could not be locked in memory: {}",
                              state_.why.empty() ? "" : "; ", what, memory.size(), strerror(errno));
}

void ServoThread::set_up() {
    if (options_.priority > 0) {
        const sched_param wanted{.sched_priority = options_.priority};
        if (const int error = pthread_setschedparam(thread_, SCHED_FIFO, &wanted))
            state_.why += fmt::format("SCHED_FIFO {}: {} (RLIMIT_RTPRIO or CAP_SYS_NICE gives it)",
                                      options_.priority, strerror(error));
    }
    if (options_.processor >= 0) {
        cpu_set_t set;
        CPU_ZERO(&set);
        CPU_SET(options_.processor, &set);
        if (const int error = pthread_setaffinity_np(thread_, sizeof(set), &set))
            state_.why += fmt::format("{}processor {}: {}", state_.why.empty() ? "" : "; ",
                                      options_.processor, strerror(error));
    }
    int policy = 0;
    sched_param got{};
    pthread_getschedparam(thread_, &policy, &got);
    state_.real_time = policy == SCHED_FIFO || policy == SCHED_RR;
    state_.policy = state_.real_time
                        ? fmt::format("{} {}", policy == SCHED_FIFO ? "SCHED_FIFO" : "SCHED_RR",
                                      got.sched_priority)
                        : "SCHED_OTHER";
    state_.locked = true;
    lock(stack_, "stack");
    lock(std::as_bytes(std::span(&servo_, 1)), "servo");
    for (const std::span<const std::byte> memory : options_.memory)
        lock(memory, "memory of ticks");
}

ServoThread::ServoThread(Servo& servo, ServoThreadOptions options)
    : servo_(servo), options_(std::move(options)) {
    void* const memory = mmap(nullptr, options_.stack_bytes, PROT_READ | PROT_WRITE,
                              MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
    PALPATE_ASSERT(memory != MAP_FAILED);
    stack_ = {static_cast<std::byte*>(memory), options_.stack_bytes};
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstack(&attributes, stack_.data(), stack_.size());
    const int error = pthread_create(&thread_, &attributes, enter, this);
    pthread_attr_destroy(&attributes);
    PALPATE_ASSERT(error == 0);
    set_up();
    crash_stop_.emplace(servo_.device());
    watchdog_.emplace(servo_, options_.priority > 0 ? options_.priority + 1 : 0);
    ready_.store(true, std::memory_order_release);
}

ServoThread::~ServoThread() {
    stop();
    for (const std::span<const std::byte> memory : locked_)
        munlock(memory.data(), memory.size());
    munmap(stack_.data(), stack_.size());
}

void ServoThread::stop() {
    stopping_.store(true, std::memory_order_release);
    if (!joined_) {
        const int64_t until_ns = monotonic_ns() + kPatience_ns;
        while (!ended() && monotonic_ns() < until_ns)
            sleep_until(monotonic_ns() + 1'000'000);
        if (!ended() && options_.hung)
            options_.hung();
        pthread_join(thread_, nullptr);
    }
    joined_ = true;
    watchdog_.reset();
    crash_stop_.reset();
}

void* ServoThread::enter(void* self) {
    auto& thread = *static_cast<ServoThread*>(self);
    while (!thread.ready_.load(std::memory_order_acquire))
        std::this_thread::yield();
    thread.run();
    thread.ended_.store(true, std::memory_order_release);
    return nullptr;
}

void ServoThread::run() {
    touch_stack(stack_.size() / 2);
    Pace pace(servo_.device(), servo_.options().rate_hz, monotonic_clock());
    ThreadUse began = thread_use();
    bool first = true;
    while (!stopping_.load(std::memory_order_acquire)) {
        const Pace::Beat beat = pace.next();
        servo_.telemetry().skipped.fetch_add(static_cast<uint64_t>(beat.skipped),
                                             std::memory_order_relaxed);
        const ServoTick tick = servo_.tick(beat.now_ns, beat.due_ns);
        if (options_.after && !options_.after(tick))
            break;
        if (first) // pages of code and data that no tick had needed before
            began = thread_use();
        first = false;
    }
    const ThreadUse end = thread_use();
    use_ = {end.page_faults - began.page_faults,
            end.involuntary_switches - began.involuntary_switches};
    servo_.release();
}

} // namespace palpate::haptics
