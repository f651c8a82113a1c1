#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "haptics/device/wooden/wooden.h"
#include "tests/unit/haptics_hands/fake_wooden.h"
#include "tests/unit/haptics_servo/bench_loop.h"

// The faults of tests/unit/haptics_falcon/fault_matrix_test.cpp that a HID device can have, in
// every phase, on WoodenHaptics' driver: force ends within two ticks of a latched fault and once
// reports have been missing for as long as the safety chain allows, no call takes 100 ms, and
// afterwards the device works again.
namespace palpate::haptics {
namespace {

using wooden::kReport;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kLongest_ns = 100 * kMs, kSilence_ns = 10 * kMs, kSetUp_ns = 1'000 * kMs;
constexpr int kFaultTicks = 60;

struct Row {
    std::string name;
    std::function<FakeTransport::Fault()> fault; // made anew for every run; may be empty
    std::function<void(FakeWooden&, bool begins)> device;
    bool ends_force = true; // by the end of kFaultTicks, in contact
    int unplugs_at = 0;     // the tick; 0: never
    int64_t clock_jump_ns = 0;
};

std::vector<Row> rows() {
    std::vector<Row> all;
    using Change = std::function<void(Transfer&)>;
    const auto add = [&](std::string name, bool ends_force, Change change) {
        all.push_back({.name = std::move(name),
                       .fault =
                           [change] {
                               return [change](Transfer& t, int64_t) {
                                   if (t.is_in())
                                       change(t);
                               };
                           },
                       .device = nullptr,
                       .ends_force = ends_force});
    };
    for (size_t size = 0; size < kReport; ++size)
        add(fmt::format("report of {} bytes", size), true, [size](Transfer& t) { t.moved = size; });
    // The upper byte of an encoder takes the grip away; the lower one may be a fast hand, and the
    // last four numbers mean nothing here.
    for (size_t at = 0; at < kReport; ++at) {
        add(fmt::format("flipped byte {}", at), at < 6 && at % 2 == 1,
            [at](Transfer& t) { t.bytes[at] ^= std::byte{0x80}; });
        add(fmt::format("inserted byte {}", at), false, [at](Transfer& t) {
            const auto bytes = t.bytes;
            std::copy(bytes.begin() + static_cast<long>(at), bytes.begin() + 63,
                      t.bytes.begin() + static_cast<long>(at) + 1);
            t.bytes[at] = std::byte{'x'};
        });
        add(fmt::format("dropped byte {}", at), false, [at](Transfer& t) {
            std::copy(t.bytes.begin() + static_cast<long>(at) + 1, t.bytes.begin() + 64,
                      t.bytes.begin() + static_cast<long>(at));
        });
    }
    all.push_back({.name = "one bit in 200 flipped",
                   .fault =
                       [] {
                           return [random = std::mt19937_64(7)](Transfer& t, int64_t) mutable {
                               if (t.is_in())
                                   for (size_t i = 0; i < kReport; ++i)
                                       if (random() % 25 == 0)
                                           t.bytes[i] ^= static_cast<std::byte>(1u << random() % 8);
                           };
                       },
                   .device = nullptr,
                   .ends_force = false});
    for (const TransferStatus status : {TransferStatus::stalled, TransferStatus::overflowed,
                                        TransferStatus::timed_out, TransferStatus::failed}) {
        add(std::string("reads: ") + text_of(status), true,
            [status](Transfer& t) { t.status = status; });
        all.push_back({.name = std::string("everything: ") + text_of(status), .fault = [status] {
                           return [status](Transfer& t, int64_t) { t.status = status; };
                       }});
    }
    all.push_back({.name = "writes hang", .fault = [] {
                       return [](Transfer& t, int64_t) {
                           if (!t.is_in())
                               t.status = TransferStatus::pending;
                       };
                   }});
    all.push_back({.name = "EAGAIN storm",
                   .fault =
                       [] {
                           return [round = 0](Transfer& t, int64_t) mutable {
                               if (!t.is_in() && ++round % 10 != 0)
                                   t.status = TransferStatus::pending;
                           };
                       },
                   .device = nullptr,
                   .ends_force = false});
    for (const int tick : {1, 2, 3, 5, 8, 13, 21})
        all.push_back({.name = fmt::format("gone at tick {}", tick),
                       .fault = nullptr,
                       .device = nullptr,
                       .unplugs_at = tick});
    all.push_back({.name = "firmware hangs",
                   .fault = nullptr,
                   .device = [](FakeWooden& f, bool begins) { f.silent = begins; }});
    all.push_back({.name = "encoders stuck",
                   .fault = nullptr,
                   .device = [](FakeWooden& f, bool begins) { f.encoders_stuck = begins; },
                   .ends_force = false});
    for (const int shift : {32767, -32768, 9000, -9000})
        all.push_back({.name = fmt::format("encoder off by {}", shift),
                       .fault = nullptr,
                       .device = [shift](FakeWooden& f, bool begins) {
                           f.encoder_shift = begins ? shift : 0;
                       }});
    all.push_back({.name = "clock 1 s ahead",
                   .fault = nullptr,
                   .device = nullptr,
                   .ends_force = false,
                   .clock_jump_ns = 1'000 * kMs});
    return all;
}

enum class Phase { idle, contact, drilling };

class Run {
 public:
    Run(const Row& row, Phase phase) : row_(row), phase_(phase), model_(wooden::kWoodenHaptics) {}

    void run() {
        open();
        while (clock_.now_ns() < 300 * kMs)
            ASSERT_NO_FATAL_FAILURE(tick());
        const bool is_pressed = phase_ != Phase::idle;
        ASSERT_EQ(last_.sent.force_n.z > 0.3, is_pressed);

        if (row_.fault)
            transport_->set_fault(row_.fault());
        if (row_.device)
            row_.device(model_, true);
        if (row_.clock_jump_ns)
            clock_.sleep_until(clock_.now_ns() + row_.clock_jump_ns);
        for (int i = 1; i <= kFaultTicks; ++i) {
            if (i == row_.unplugs_at)
                transport_->unplug();
            ASSERT_NO_FATAL_FAILURE(tick());
        }
        if (row_.ends_force && is_pressed) {
            ASSERT_EQ(last_.sent, Wrench{});
        }
        if (!transport_->gone())
            transport_->set_fault(nullptr);
        if (row_.device)
            row_.device(model_, false);
        ASSERT_NO_FATAL_FAILURE(recover());
    }

 private:
    // mm above the wall; in contact it is left and met again for the soft start.
    double height_mm() {
        const int64_t now_ns = clock_.now_ns() - jumped_ns();
        const bool pressed = (phase_ != Phase::idle && now_ns > 200 * kMs && now_ns < 400 * kMs) ||
                             now_ns > 900 * kMs;
        const int64_t since_ns = now_ns > 900 * kMs   ? now_ns - 900 * kMs
                                 : now_ns > 400 * kMs ? now_ns - 400 * kMs
                                                      : now_ns - 200 * kMs;
        const double share = std::clamp(static_cast<double>(since_ns) / (60.0 * kMs), 0.0, 1.0);
        const bool was_pressed = phase_ != Phase::idle && now_ns >= 400 * kMs;
        return pressed ? 8.0 - 12.0 * share : was_pressed ? -4.0 + 12.0 * share : 8.0;
    }
    int64_t jumped_ns() {
        return row_.clock_jump_ns && clock_.now_ns() > 1'000 * kMs ? row_.clock_jump_ns : 0;
    }
    void open() {
        auto made = std::make_unique<FakeTransport>(model_, clock_);
        transport_ = made.get();
        auto device = WoodenDevice::open(std::move(made), wooden::kWoodenHaptics, 64);
        ASSERT_TRUE(device) << device.error().message;
        Servo::Options options;
        options.limits.ramp_s = 0.1;
        loop_ =
            std::make_unique<Loop>(TouchScene{}, TouchParameters{.stiffness_n_per_m = 500.0},
                                   std::make_unique<WallAlgorithm>(), std::move(*device), options);
        since_latch_ = 0;
        silent_ns_ = 0;
    }
    void recover() {
        for (int i = 0; i < 20; ++i)
            ASSERT_NO_FATAL_FAILURE(tick());
        if (transport_->gone()) {
            loop_.reset();
            model_.plugged();
            const int64_t began_ns = clock_.now_ns();
            ASSERT_NO_FATAL_FAILURE(open());
            ASSERT_LT(clock_.now_ns() - began_ns, kSetUp_ns);
        }
        bool armed = false;
        while (clock_.now_ns() - jumped_ns() < 1'000 * kMs) {
            if (!armed && clock_.now_ns() - jumped_ns() > 600 * kMs) {
                loop_->servo.arm();
                armed = true;
            }
            ASSERT_NO_FATAL_FAILURE(tick());
        }
        ASSERT_EQ(last_.status, DeviceStatus::ok);
        ASSERT_GT(last_.sent.force_n.z, 0.3) << fault_text(last_.faults);
        ASSERT_NE(model_.command.motors_ma, (std::array<int16_t, 3>{}));
    }
    void tick() {
        const int64_t began_ns = clock_.now_ns();
        clock_.sleep_until(began_ns + kMs);
        model_.place_m = {0.0, 0.0, 1e-3 * height_mm()};
        if (phase_ == Phase::drilling) // the wall gives way by 1 mm a second
            loop_->scenes.publish(std::make_unique<const TouchScene>(TouchScene{
                .version =
                    static_cast<uint64_t>(std::max<int64_t>(0, 1000 - clock_.now_ns() / kMs))}));
        last_ = loop_->servo.tick(clock_.now_ns(), clock_.now_ns());
        transport_->reap(0); // what the system does meanwhile
        ASSERT_LT(clock_.now_ns() - began_ns, kLongest_ns);
        const double size = glm::length(last_.sent.force_n);
        ASSERT_TRUE(std::isfinite(size));
        ASSERT_LE(size, 0.8 * 5.0 * (1 + 1e-9));
        for (const int current : model_.command.motors_ma)
            ASSERT_LE(std::abs(current), WoodenDevice::kMost_ma);
        since_latch_ = last_.faults & kFaultLatched ? since_latch_ + 1 : 0;
        if (since_latch_ >= 2 && !(last_.faults & kFaultVelocity)) {
            ASSERT_EQ(last_.sent, Wrench{});
        }
        if (last_.status == DeviceStatus::ok)
            silent_ns_ = 0;
        else if (silent_ns_ == 0)
            silent_ns_ = last_.now_ns;
        if (silent_ns_ != 0 && last_.now_ns - silent_ns_ > kSilence_ns + 2 * kMs) {
            ASSERT_EQ(last_.sent, Wrench{});
        }
    }

    const Row& row_;
    Phase phase_;
    VirtualClock clock_;
    FakeWooden model_;
    FakeTransport* transport_ = nullptr;
    std::unique_ptr<Loop> loop_;
    ServoTick last_;
    int since_latch_ = 0;
    int64_t silent_ns_ = 0;
};

void run_phase(Phase phase, const char* name) {
    const std::vector<Row> all = rows();
    int hold = 0;
    for (const Row& row : all) {
        SCOPED_TRACE(row.name);
        Run(row, phase).run();
        hold += !testing::Test::HasFailure();
    }
    fmt::print("| WoodenHaptics | {} | {} of {} |\n", name, hold, all.size());
}

TEST(WoodenFaults, WhileIdle) {
    run_phase(Phase::idle, "idle");
}
TEST(WoodenFaults, InContact) {
    run_phase(Phase::contact, "contact");
}
TEST(WoodenFaults, WhileDrilling) {
    run_phase(Phase::drilling, "drilling");
}

// While it is opened: it works, or says in a sentence why not, soon; then it can be opened.
TEST(WoodenFaults, WhileStarting) {
    int hold = 0;
    const std::vector<Row> all = rows();
    for (const Row& row : all) {
        SCOPED_TRACE(row.name);
        VirtualClock clock;
        FakeWooden model(wooden::kWoodenHaptics);
        const auto open = [&](FakeTransport::Fault fault) {
            auto made = std::make_unique<FakeTransport>(model, clock);
            FakeTransport* const transport = made.get();
            // It lives as long as the device.
            transport->set_fault([&row, &clock, transport, calls = 0, fault = std::move(fault)](
                                     Transfer& t, int64_t now_ns) mutable {
                if (++calls == row.unplugs_at) {
                    transport->unplug();
                    t.status = TransferStatus::gone;
                } else if (fault) {
                    fault(t, now_ns);
                }
                if (calls == 1 && row.clock_jump_ns)
                    clock.sleep_until(now_ns + row.clock_jump_ns);
            });
            return WoodenDevice::open(std::move(made), wooden::kWoodenHaptics, 64);
        };
        if (row.device)
            row.device(model, true);
        const int64_t began_ns = clock.now_ns();
        {
            const auto device = open(row.fault ? row.fault() : nullptr);
            EXPECT_LT(clock.now_ns() - began_ns - row.clock_jump_ns, kSetUp_ns);
            if (!device) {
                EXPECT_EQ(device.error().message.find("WoodenHaptics: "), 0u)
                    << device.error().message;
            }
        }
        if (row.device)
            row.device(model, false);
        model.plugged();
        auto made = std::make_unique<FakeTransport>(model, clock);
        EXPECT_TRUE(WoodenDevice::open(std::move(made), wooden::kWoodenHaptics, 64));
        hold += !testing::Test::HasFailure();
    }
    fmt::print("| WoodenHaptics | boot | {} of {} |\n", hold, all.size());
}

} // namespace
} // namespace palpate::haptics
