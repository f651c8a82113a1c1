#pragma once

#include <ucontext.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

// Runs a few short threads in every order that their operations on shared memory can take.
//
// Code under test uses interleave::Atomic in place of std::atomic, and says step() before it
// touches other shared memory. Threads are fibres of one real thread, so a step is never torn.
// Memory is that of total store order (x86): a store weaker than sequentially consistent waits in
// its thread's buffer, first in first out, and reaching memory is a step of its own; a thread sees
// its own buffer first. That is how a store shows after a later load. Weaker machines are left to
// the thread sanitizer.
//
// Orders that differ only by swapping neighbouring steps which touch different memory, or only read
// it, are one order: a depth-first walk with sleep sets runs each of them once (P. Godefroid,
// Partial-Order Methods for the Verification of Concurrent Systems, 1996, chapter 5).
namespace palpate::interleave {

struct Access {
    const void* address;
    bool writes;
};
using Footprint = std::vector<Access>;

class Explorer {
 public:
    // Thread bodies of one run; made anew for every run, with everything they share.
    using Make = std::function<std::vector<std::function<void()>>()>;
    struct Report {
        uint64_t orders = 0;   // run to their end and checked
        std::string violation; // the first one; empty where there was none
    };

    // Explores all orders, or stops at the first violation. `finish` is called after each, with all
    // stores in memory.
    Report explore(const Make& make, const std::function<void()>& finish);

    // Before shared memory is touched; on no fibre it does nothing.
    void step(Footprint footprint) {
        if (running_ == kNone)
            return;
        fibers_[running_].next = std::move(footprint);
        swapcontext(&fibers_[running_].context, &scheduler_);
    }
    // A step that is taken only once `ready` is true; where that never comes the fibre stays there.
    void wait(Footprint footprint, std::function<bool()> ready) {
        if (running_ == kNone)
            return;
        fibers_[running_].ready = std::move(ready);
        step(std::move(footprint));
        fibers_[running_].ready = {};
    }
    void expect(bool truth, const char* what) {
        if (!truth && report_.violation.empty())
            report_.violation = what;
    }

    // Stores that have not reached memory yet.
    struct Store {
        const void* address;
        std::function<void()> write;
    };
    // The buffer of the running fibre; null on none.
    std::deque<Store>* buffer() { return running_ == kNone ? nullptr : &fibers_[running_].stores; }

    static Explorer& current() {
        static Explorer explorer;
        return explorer;
    }

 private:
    static constexpr size_t kNone = ~size_t{0};
    struct Fiber {
        ucontext_t context{};
        std::vector<std::byte> stack = std::vector<std::byte>(64 << 10);
        std::function<void()> body;
        bool done = false;
        Footprint next;              // of the step it is about to take
        std::function<bool()> ready; // whether it can; empty: it can
        std::deque<Store> stores;
    };
    struct Choice { // a thread's next step, or the oldest store of its buffer
        size_t thread;
        bool flush;
        Footprint footprint;
    };
    struct Node {
        std::vector<Choice> enabled;
        std::vector<bool> asleep; // has been run, or needs not be run, from here
        size_t taken;
    };
    static bool independent(const Choice& a, const Choice& b);
    static void enter();
    void start(size_t thread, std::function<void()> body);
    void resume(size_t thread);
    std::vector<Choice> choices() const;
    void take(const Choice& choice);
    static bool take_first_awake(Node& node);
    bool run_once(const Make& make);

    ucontext_t scheduler_{};
    std::deque<Fiber> fibers_;
    size_t threads_ = 0;
    size_t running_ = kNone;
    std::vector<Node> path_;
    Report report_;
};

inline bool Explorer::independent(const Choice& a, const Choice& b) {
    if (a.thread == b.thread)
        return false;
    for (const Access& x : a.footprint)
        for (const Access& y : b.footprint)
            if (x.address == y.address && (x.writes || y.writes))
                return false;
    return true;
}

inline void Explorer::enter() {
    Fiber& fiber = current().fibers_[current().running_];
    fiber.body();
    fiber.done = true;
    swapcontext(&fiber.context, &current().scheduler_);
}

inline void Explorer::resume(size_t thread) {
    running_ = thread;
    swapcontext(&scheduler_, &fibers_[thread].context);
    running_ = kNone;
}

inline std::vector<Explorer::Choice> Explorer::choices() const {
    std::vector<Choice> list;
    for (size_t i = 0; i < threads_; ++i)
        if (!fibers_[i].done && (!fibers_[i].ready || fibers_[i].ready()))
            list.push_back({i, false, fibers_[i].next});
    for (size_t i = 0; i < threads_; ++i)
        if (!fibers_[i].stores.empty())
            list.push_back({i, true, {{fibers_[i].stores.front().address, true}}});
    return list;
}

inline void Explorer::take(const Choice& choice) {
    if (!choice.flush)
        return resume(choice.thread);
    std::deque<Store>& stores = fibers_[choice.thread].stores;
    stores.front().write();
    stores.pop_front();
}

inline bool Explorer::take_first_awake(Node& node) {
    const auto awake = std::find(node.asleep.begin(), node.asleep.end(), false);
    node.taken = static_cast<size_t>(awake - node.asleep.begin());
    return awake != node.asleep.end();
}

// Up to its first step.
inline void Explorer::start(size_t thread, std::function<void()> body) {
    Fiber& fiber = fibers_[thread];
    fiber.body = std::move(body);
    fiber.done = false;
    fiber.ready = {};
    fiber.stores.clear();
    getcontext(&fiber.context);
    fiber.context.uc_stack.ss_sp = fiber.stack.data();
    fiber.context.uc_stack.ss_size = fiber.stack.size();
    fiber.context.uc_link = nullptr;
    makecontext(&fiber.context, &Explorer::enter, 0);
    resume(thread);
}

// False: what was run is an order that had been run before.
inline bool Explorer::run_once(const Make& make) {
    std::vector<std::function<void()>> bodies = make();
    threads_ = bodies.size();
    while (fibers_.size() < threads_)
        fibers_.emplace_back();
    for (size_t i = 0; i < threads_; ++i)
        start(i, std::move(bodies[i]));
    bool is_new = true;
    for (size_t depth = 0;; ++depth) {
        std::vector<Choice> enabled = choices();
        if (enabled.empty())
            return is_new;
        if (!is_new) { // only so that the threads end
            take(enabled.front());
            continue;
        }
        if (depth == path_.size()) {
            Node node{std::move(enabled), {}, 0};
            node.asleep.resize(node.enabled.size());
            if (depth > 0) {
                const Node& before = path_.back();
                for (size_t i = 0; i < before.enabled.size(); ++i)
                    for (size_t k = 0; before.asleep[i] && k < node.enabled.size(); ++k)
                        if (node.enabled[k].thread == before.enabled[i].thread &&
                            node.enabled[k].flush == before.enabled[i].flush &&
                            independent(before.enabled[i], before.enabled[before.taken]))
                            node.asleep[k] = true;
            }
            if (!take_first_awake(node)) {
                is_new = false;
                take(node.enabled.front());
                continue;
            }
            path_.push_back(std::move(node));
        }
        take(path_[depth].enabled[path_[depth].taken]);
    }
}

inline Explorer::Report Explorer::explore(const Make& make, const std::function<void()>& finish) {
    report_ = {};
    path_.clear();
    for (;;) {
        const bool is_new = run_once(make);
        finish();
        report_.orders += is_new;
        if (!report_.violation.empty())
            return report_;
        while (!path_.empty()) {
            path_.back().asleep[path_.back().taken] = true;
            if (take_first_awake(path_.back()))
                break;
            path_.pop_back();
        }
        if (path_.empty())
            return report_;
    }
}

// std::atomic as far as the code under test uses it. With Strongest = memory_order_release,
// sequentially consistent stores are taken for weaker ones: so a test shows that the order matters.
template <class T, std::memory_order Strongest = std::memory_order_seq_cst>
class OrderedAtomic {
 public:
    explicit OrderedAtomic(T value = T{}) : value_(value) {}
    OrderedAtomic(const OrderedAtomic&) = delete;
    OrderedAtomic& operator=(const OrderedAtomic&) = delete;

    T load(std::memory_order) const {
        Explorer::current().step({{this, false}});
        const auto* buffer = Explorer::current().buffer();
        for (auto it = waiting_.rbegin(); it != waiting_.rend(); ++it)
            if (it->buffer == buffer)
                return it->value;
        return value_;
    }
    void store(T value, std::memory_order order) {
        const bool waits =
            order != std::memory_order_seq_cst || Strongest != std::memory_order_seq_cst;
        Explorer::current().step(waits ? Footprint{} : all_written());
        auto* buffer = Explorer::current().buffer();
        if (waits && buffer) {
            waiting_.push_back({buffer, value});
            buffer->push_back({this, [this, value] {
                                   value_ = value;
                                   waiting_.pop_front();
                               }});
        } else {
            drain();
            value_ = value;
        }
    }
    bool compare_exchange_strong(T& expected, T desired, std::memory_order) {
        Explorer::current().step(all_written());
        drain();
        if (value_ == expected) {
            value_ = desired;
            return true;
        }
        expected = value_;
        return false;
    }
    T fetch_add(T more, std::memory_order) {
        Explorer::current().step(all_written());
        drain();
        return std::exchange(value_, static_cast<T>(value_ + more));
    }
    T exchange(T next, std::memory_order) {
        Explorer::current().step(all_written());
        drain();
        return std::exchange(value_, next);
    }

 private:
    Footprint all_written() const {
        Footprint footprint{{this, true}};
        if (const auto* buffer = Explorer::current().buffer())
            for (const Explorer::Store& store : *buffer)
                footprint.push_back({store.address, true});
        return footprint;
    }
    static void drain() {
        auto* buffer = Explorer::current().buffer();
        while (buffer && !buffer->empty()) {
            buffer->front().write();
            buffer->pop_front();
        }
    }
    struct Waiting {
        const void* buffer;
        T value;
    };
    T value_;
    std::deque<Waiting> waiting_; // in buffers, oldest first; one thread stores to an atomic here
};

template <class T>
using Atomic = OrderedAtomic<T>;
template <class T>
using WeakAtomic = OrderedAtomic<T, std::memory_order_release>;

} // namespace palpate::interleave
