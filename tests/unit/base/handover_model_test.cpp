#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <set>

#include "engine/base/mailbox.h"
#include "engine/base/ring.h"
#include "engine/base/wake.h"
#include "tests/support/interleave.h"

// The handover between servo and editor in every order that its operations can take.
namespace palpate {
namespace {

using interleave::Explorer;

constexpr int kMostVersions = 4;
bool alive[kMostVersions];

// A value whose memory outlives it, so that reading it too late is an observation and no crash.
struct Version {
    int number;
    explicit Version(int n) : number(n) { alive[n] = true; }
    ~Version() {
        Explorer::current().step({{&alive[number], true}});
        alive[number] = false;
    }
    static void* operator new(size_t size) {
        static std::byte pool[kMostVersions * 16][64];
        static size_t next = 0;
        static_assert(sizeof(pool[0]) >= 8);
        return size <= sizeof(pool[0]) ? pool[next++ % (kMostVersions * 16)] : nullptr;
    }
    static void operator delete(void*) {}
};

#if defined(__SANITIZE_THREAD__)
#define PALPATE_SKIP_FIBERS() GTEST_SKIP() << "the thread sanitizer does not follow fibres"
#else
#define PALPATE_SKIP_FIBERS() (void)0
#endif

// One reader that pins `pins` times while a writer publishes `versions` - 1 times; or, renewed, as
// many readers after one another, each in the place that the one before gave back.
template <template <class> class Atomic>
Explorer::Report explore_mailbox(int pins, int versions, bool renewed = false) {
    Explorer& explorer = Explorer::current();
    using Box = Mailbox<Version, Atomic>;
    std::optional<Box> box;
    std::optional<typename Box::Reader> reader;
    int published = 0;
    const auto make = [&]() -> std::vector<std::function<void()>> {
        box.emplace(std::make_unique<const Version>(0));
        reader.emplace(box->add_reader());
        published = 0;
        const auto read = [&, pins, renewed] {
            int seen = 0;
            for (int i = 0; i < pins; ++i) {
                if (renewed && i > 0) { // the place is given back, and taken by another reader
                    reader.reset();
                    reader.emplace(box->add_reader());
                }
                explorer.step({{&published, false}});
                const int before = published;
                const auto pin = reader->pin();
                const int number = pin->number;
                explorer.step({{&alive[number], false}});
                explorer.expect(alive[number], "the pinned value was freed before pin() returned");
                explorer.expect(number >= seen, "an older value after a newer one");
                explorer.expect(number >= before, "older than what had been published");
                seen = number;
                explorer.step({{&alive[number], false}});
                explorer.expect(alive[number], "the pinned value was freed while pinned");
            }
        };
        const auto write = [&, versions] {
            for (int v = 1; v < versions; ++v) {
                box->publish(std::make_unique<const Version>(v));
                explorer.step({{&published, true}});
                published = v;
            }
        };
        return {read, write};
    };
    const auto finish = [&] {
        box->collect();
        explorer.expect(box->waiting() == 0, "something was never freed");
        for (int v = 0; v < versions; ++v)
            explorer.expect(alive[v] == (v == versions - 1), "what is alive is not the last value");
        reader.reset();
        box.reset();
    };
    return explorer.explore(make, finish);
}

// Each of two threads stores to its own flag and reads the other's. `T0 T1` is what they read.
template <template <class> class Atomic>
std::set<std::pair<int, int>> what_two_flags_show() {
    Explorer& explorer = Explorer::current();
    std::optional<Atomic<int>> x, y;
    std::pair<int, int> seen;
    std::set<std::pair<int, int>> all;
    explorer.explore(
        [&]() -> std::vector<std::function<void()>> {
            x.emplace(0);
            y.emplace(0);
            return {[&] {
                        x->store(1, std::memory_order_seq_cst);
                        seen.first = y->load(std::memory_order_seq_cst);
                    },
                    [&] {
                        y->store(1, std::memory_order_seq_cst);
                        seen.second = x->load(std::memory_order_seq_cst);
                    }};
        },
        [&] { all.insert(seen); });
    return all;
}

TEST(Interleave, AStoreCanPassALaterLoadUnlessItIsSequentiallyConsistent) {
    PALPATE_SKIP_FIBERS();
    using Set = std::set<std::pair<int, int>>;
    EXPECT_EQ(what_two_flags_show<interleave::Atomic>(), (Set{{0, 1}, {1, 0}, {1, 1}}));
    EXPECT_EQ(what_two_flags_show<interleave::WeakAtomic>(), (Set{{0, 0}, {0, 1}, {1, 0}, {1, 1}}));
}

TEST(Interleave, OrdersThatNobodyCanTellApartAreOne) {
    PALPATE_SKIP_FIBERS();
    Explorer& explorer = Explorer::current();
    int a = 0, b = 0, c = 0;
    const auto steps = [&](int* first, int* second) {
        return [&explorer, first, second] {
            explorer.step({{first, true}});
            explorer.step({{second, true}});
        };
    };
    const auto orders = [&](int* first, int* second) {
        return explorer
            .explore(
                [&] {
                    return std::vector<std::function<void()>>{steps(&a, &b), steps(first, second)};
                },
                [] {})
            .orders;
    };
    EXPECT_EQ(orders(&c, &c), 1u); // nothing shared
    EXPECT_EQ(orders(&c, &b), 2u); // whose b comes first
    EXPECT_EQ(orders(&a, &b), 4u); // whose a and whose b
    EXPECT_EQ(orders(&b, &a), 3u); // the same, but not both second
}

// MailboxModel takes over 5 s of a processor: every order of the steps of two threads is tried.
TEST(MailboxModel, TwoPinsWhileThreeVersionsPassAreSafeInEveryOrder) {
    PALPATE_SKIP_FIBERS();
    const Explorer::Report report = explore_mailbox<interleave::Atomic>(2, 3);
    EXPECT_EQ(report.violation, "") << "after " << report.orders << " orders";
    std::printf("%llu orders\n", static_cast<unsigned long long>(report.orders));
}

TEST(MailboxModel, APlaceThatIsGivenBackAndTakenAgainIsSafeInEveryOrder) {
    PALPATE_SKIP_FIBERS();
    const Explorer::Report report = explore_mailbox<interleave::Atomic>(2, 3, true);
    EXPECT_EQ(report.violation, "") << "after " << report.orders << " orders";
    std::printf("%llu orders\n", static_cast<unsigned long long>(report.orders));
}

TEST(MailboxModel, AWeakerStoreToTheSlotLetsTheWriterFreeWhatIsRead) {
    PALPATE_SKIP_FIBERS();
    const Explorer::Report report = explore_mailbox<interleave::WeakAtomic>(1, 2);
    EXPECT_NE(report.violation, "");
}

// Copied in two steps, so that a value read while it is written shows.
struct Pair {
    int a = 0, b = 0;
    Pair() = default;
    explicit Pair(int n) : a(n), b(n) {}
    Pair(const Pair&) = default;
    Pair& operator=(const Pair& other) {
        Explorer::current().step({{&a, true}, {&other.a, false}});
        a = other.a;
        Explorer::current().step({{&b, true}, {&other.b, false}});
        b = other.b;
        return *this;
    }
};

// The producer pushes 1 .. count, each as often as it is refused up to `tries` times; the consumer
// pops as often as it pleases. What is popped is what was accepted, in order, whole.
struct RingReport : Explorer::Report {
    std::set<std::vector<int>> popped; // by the consumer's thread, in each order
};

template <class RingType>
RingReport explore_ring(size_t capacity, int count, int pops) {
    RingReport all;
    Explorer& explorer = Explorer::current();
    std::optional<RingType> ring;
    std::vector<int> accepted, popped;
    const auto pop_one = [&] {
        Pair value;
        if (!ring->pop(value))
            return false;
        explorer.expect(value.a == value.b, "a torn value");
        popped.push_back(value.a);
        return true;
    };
    const auto make = [&]() -> std::vector<std::function<void()>> {
        ring.emplace(capacity);
        accepted.clear();
        popped.clear();
        return {[&, count] {
                    for (int i = 1; i <= count; ++i)
                        if (ring->push(Pair(i)))
                            accepted.push_back(i);
                },
                [&, pops] {
                    for (int i = 0; i < pops; ++i)
                        pop_one();
                }};
    };
    const auto finish = [&] {
        all.popped.insert(popped);
        while (pop_one()) {
        }
        explorer.expect(popped == accepted, "popped is not what was accepted, in order");
        explorer.expect(accepted.size() >= std::min<size_t>(capacity, static_cast<size_t>(count)),
                        "refused although there was room");
        ring.reset();
    };
    static_cast<Explorer::Report&>(all) = explorer.explore(make, finish);
    return all;
}

TEST(RingModel, NothingIsLostTornOrReorderedInEveryOrder) {
    PALPATE_SKIP_FIBERS();
    using Popped = std::set<std::vector<int>>;
    const auto small = explore_ring<Ring<Pair, interleave::Atomic>>(1, 3, 3);
    EXPECT_EQ(small.violation, "");
    // A full ring may refuse the second of three values, the third, or both.
    EXPECT_EQ(small.popped, (Popped{{}, {1}, {1, 2}, {1, 3}, {1, 2, 3}}));
    const auto larger = explore_ring<Ring<Pair, interleave::Atomic>>(2, 3, 3);
    EXPECT_EQ(larger.violation, "");
    EXPECT_EQ(larger.popped, (Popped{{}, {1}, {1, 2}, {1, 2, 3}}));
    std::printf("%llu and %llu orders\n", static_cast<unsigned long long>(small.orders),
                static_cast<unsigned long long>(larger.orders));
}

// A ring that announces a value before it is written: the model must find it.
template <class T, template <class> class Atomic>
class EarlyRing {
 public:
    explicit EarlyRing(size_t) {}
    bool push(const T& value) {
        const size_t at = pushed_.load(std::memory_order_relaxed);
        pushed_.store(at + 1, std::memory_order_seq_cst);
        values_[at] = value;
        return true;
    }
    bool pop(T& value) {
        const size_t at = popped_.load(std::memory_order_relaxed);
        if (at == pushed_.load(std::memory_order_acquire))
            return false;
        value = values_[at];
        popped_.store(at + 1, std::memory_order_release);
        return true;
    }

 private:
    T values_[8];
    Atomic<size_t> pushed_{0}, popped_{0};
};

// A kernel that looks at the word and goes to sleep in one step, and wakes in another. Where kLooks
// is false it goes to sleep without a look.
template <bool kLooks>
struct ModelSleep {
    static inline bool sleeping = false;
    template <class Word>
    static bool sleep(Word& word, uint32_t value, std::optional<Wake::Clock::time_point>) {
        Explorer& explorer = Explorer::current();
        if (kLooks && word.load(std::memory_order_relaxed) != value)
            return true;
        if (!kLooks)
            explorer.step({{&sleeping, true}});
        sleeping = true;
        explorer.wait({{&sleeping, false}, {&word, false}}, [] { return !sleeping; });
        return true;
    }
    template <class Word>
    static void wake(Word& word) {
        Explorer::current().step({{&sleeping, true}, {&word, true}});
        sleeping = false;
    }
};

// A publisher writes 1 .. news, and wakes after each. The follower looks until it has seen the
// last: whatever the order, it gets there.
template <class Sleep>
Explorer::Report explore_wake(int news) {
    Explorer& explorer = Explorer::current();
    std::optional<BasicWake<interleave::Atomic, Sleep>> wake;
    std::optional<interleave::Atomic<int>> published;
    bool has_seen_all = false;
    const auto make = [&]() -> std::vector<std::function<void()>> {
        wake.emplace();
        published.emplace(0);
        has_seen_all = Sleep::sleeping = false;
        return {[&, news] {
                    for (int v = 1; v <= news; ++v) {
                        published->store(v, std::memory_order_release);
                        wake->wake();
                    }
                },
                [&, news] {
                    while (published->load(std::memory_order_acquire) < news)
                        explorer.expect(wake->wait(), "a wait that ended without a wake");
                    has_seen_all = true;
                }};
    };
    return explorer.explore(make, [&] { explorer.expect(has_seen_all, "a wake was lost"); });
}

TEST(WakeModel, NoWakeIsLostInEveryOrder) {
    PALPATE_SKIP_FIBERS();
    const Explorer::Report report = explore_wake<ModelSleep<true>>(2);
    EXPECT_EQ(report.violation, "") << "after " << report.orders << " orders";
    std::printf("%llu orders\n", static_cast<unsigned long long>(report.orders));
}

TEST(WakeModel, FindsASleepThatDoesNotLookFirst) {
    PALPATE_SKIP_FIBERS();
    EXPECT_EQ(explore_wake<ModelSleep<false>>(1).violation, "a wake was lost");
}

TEST(RingModel, FindsARingThatAnnouncesTooEarly) {
    PALPATE_SKIP_FIBERS();
    const auto report = explore_ring<EarlyRing<Pair, interleave::Atomic>>(8, 2, 2);
    EXPECT_NE(report.violation, "");
}

} // namespace
} // namespace palpate
