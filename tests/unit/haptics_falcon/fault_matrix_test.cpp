#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "tests/unit/haptics_falcon/loop_bench.h"

// Every fault of cable, system and device, in every phase. Whatever happens: what the servo sends
// is finite and within limits; it is nothing within two ticks of a latched fault, and once samples
// have been missing for as long as the safety chain allows; no call takes 100 ms; and afterwards
// the device works again, where it is gone after it was opened anew.
namespace palpate::haptics::falcon {
namespace {

constexpr int64_t kLongest_ns = 100 * kMs; // of any call
constexpr int64_t kSilence_ns = 10 * kMs;  // limits.too_late_ns of the safety chain
constexpr int64_t kBoot_ns = 5'000 * kMs;  // of opening, which may load firmware
constexpr int kFaultTicks = 60;

using Bytes = std::vector<std::byte>;

// Changes what comes from the device; called for every transfer that holds a byte of its line.
using Change = std::function<void(Bytes& line)>;

// The line's bytes of incoming transfers through `change`, with status bytes left alone.
FakeTransport::Fault of_line(Change change) {
    return [change = std::move(change)](Transfer& t, int64_t) {
        if (!t.is_in() || t.moved <= 2)
            return;
        Bytes line(t.bytes.begin() + 2, t.bytes.begin() + static_cast<long>(t.moved));
        change(line);
        line.resize(std::min(line.size(), kPayload));
        std::copy(line.begin(), line.end(), t.bytes.begin() + 2);
        t.moved = line.size() + 2;
    };
}

FakeTransport::Fault all_end_as(TransferStatus status) {
    return [status](Transfer& t, int64_t) { t.status = status; };
}

FakeTransport::Fault in_ends_as(TransferStatus status) {
    return [status](Transfer& t, int64_t) {
        if (t.is_in())
            t.status = status;
    };
}

struct Row {
    std::string name;
    // The transport's part while the fault lasts; made anew for every run. May be empty.
    std::function<FakeTransport::Fault()> fault;
    // The device's part.
    std::function<void(FakeFalcon&, bool begins)> device;
    bool ends_force = true; // by the end of kFaultTicks, in contact
    bool unplugs = false;
    int64_t clock_jump_ns = 0;
    int lasts = kFaultTicks;
    bool is_long = false; // until the device is back
};

std::vector<Row> rows() {
    std::vector<Row> all;
    const auto add_line = [&](std::string name, bool ends_force, std::function<Change()> make) {
        all.push_back({.name = std::move(name),
                       .fault = [make] { return of_line(make()); },
                       .device = nullptr,
                       .ends_force = ends_force});
    };
    add_line("short read", true, [] { return [](Bytes& line) { line.resize(line.size() / 2); }; });
    add_line("status alone", true, [] { return [](Bytes& line) { line.clear(); }; });
    for (size_t offset = 0; offset <= kPacket; ++offset)
        add_line("split at " + std::to_string(offset), false, [offset] {
            return [offset, tail = Bytes()](Bytes& line) mutable {
                line.insert(line.begin(), tail.begin(), tail.end());
                const size_t cut = std::min(offset, line.size());
                tail.assign(line.begin() + static_cast<long>(cut), line.end());
                line.resize(cut);
                if (tail.size() > kPayload) // the cable delivers in the end
                    line.swap(tail);
            };
        });
    add_line("two packets at once", false, [] {
        return [held = Bytes()](Bytes& line) mutable {
            if (held.empty()) {
                held.swap(line);
            } else {
                line.insert(line.begin(), held.begin(), held.end());
                held.clear();
            }
        };
    });
    for (size_t at = 0; at < kPacket; ++at) {
        add_line("flipped byte " + std::to_string(at), at != 14, [at] { // 14 means nothing
            return [at](Bytes& line) {
                if (at < line.size())
                    line[at] ^= std::byte{0x80};
            };
        });
        add_line("dropped byte " + std::to_string(at), true, [at] {
            return [at](Bytes& line) {
                if (at < line.size())
                    line.erase(line.begin() + static_cast<long>(at));
            };
        });
        add_line("inserted byte " + std::to_string(at), at != 0, [at] {
            return [at](Bytes& line) {
                if (at < line.size())
                    line.insert(line.begin() + static_cast<long>(at), std::byte{'x'});
            };
        });
    }
    add_line("one bit in 200 flipped", false, [] {
        return [random = std::mt19937_64(7)](Bytes& line) mutable {
            for (std::byte& byte : line)
                if (random() % 25 == 0)
                    byte ^= static_cast<std::byte>(1u << random() % 8);
        };
    });
    all.push_back({.name = "empty read", .fault = [] {
                       return [](Transfer& t, int64_t) {
                           if (t.is_in())
                               t.moved = 0;
                       };
                   }});
    for (const TransferStatus status : {TransferStatus::stalled, TransferStatus::overflowed,
                                        TransferStatus::timed_out, TransferStatus::failed}) {
        all.push_back({.name = std::string("reads: ") + text_of(status),
                       .fault = [status] { return in_ends_as(status); }});
        // The last is what a second process that claims the interface causes.
        all.push_back({.name = std::string("everything: ") + text_of(status),
                       .fault = [status] { return all_end_as(status); }});
    }
    all.push_back({.name = "writes hang", .fault = [] {
                       return [](Transfer& t, int64_t) {
                           if (!t.is_in())
                               t.status = TransferStatus::pending;
                       };
                   }});
    all.push_back({.name = "reads hang", .fault = [] {
                       return [](Transfer& t, int64_t) {
                           if (t.is_in())
                               t.moved = 2;
                       };
                   }});
    // Nine of ten rounds in which a message could go out, it does not.
    all.push_back({.name = "EAGAIN storm",
                   .fault =
                       [] {
                           return [round = 0](Transfer& t, int64_t) mutable {
                               if (t.kind == TransferKind::bulk && !t.is_in() && ++round % 10 != 0)
                                   t.status = TransferStatus::pending;
                           };
                       },
                   .device = nullptr,
                   .ends_force = false});
    for (const int64_t late_ms : {1, 2, 5, 10, 20, 50})
        all.push_back({.name = "answers " + std::to_string(late_ms) + " ms late",
                       .fault =
                           [late_ms] {
                               return [late_ms, until_ns = int64_t{0}](Transfer& t,
                                                                       int64_t now_ns) mutable {
                                   if (!t.is_in()) {
                                       if (t.kind == TransferKind::bulk && until_ns < now_ns)
                                           until_ns = now_ns + late_ms * kMs;
                                       if (now_ns < until_ns && now_ns > until_ns - late_ms * kMs)
                                           t.status = TransferStatus::pending;
                                   }
                               };
                           },
                       .device = nullptr,
                       .ends_force = false});
    for (int call = 1; call <= 12; ++call)
        all.push_back({.name = "gone at call " + std::to_string(call),
                       .fault = nullptr,
                       .device = nullptr,
                       .unplugs = true,
                       .lasts = call});
    all.push_back({.name = "firmware hangs",
                   .fault = nullptr,
                   .device = [](FakeFalcon& f, bool begins) { f.silent = begins; }});
    all.push_back({.name = "encoders stuck",
                   .fault = nullptr,
                   .device = [](FakeFalcon& f, bool begins) { f.encoders_stuck = begins; },
                   .ends_force = false});
    // By 16 bits and more than the arms can turn: no place belongs to the angles.
    for (const int shift : {32767, -32768, 3000, -2500, 700, -700})
        all.push_back(
            {.name = (std::abs(shift) > kMostCounts ? "no place: encoders off by "
                                                    : "encoder jump of ") +
                     std::to_string(shift),
             .fault = nullptr,
             .device = [shift](FakeFalcon& f, bool begins) {
                 f.encoder_shift = {begins ? static_cast<int16_t>(shift) : int16_t{0}, 0, 0};
             }});
    all.push_back({.name = "power lost and back",
                   .fault = nullptr,
                   .device =
                       [](FakeFalcon& f, bool begins) {
                           if (begins)
                               f.plugged();
                       },
                   .is_long = true});
    all.push_back({.name = "clock 1 s ahead",
                   .fault = nullptr,
                   .device = nullptr,
                   .ends_force = false,
                   .clock_jump_ns = 1'000 * kMs,
                   .lasts = 3});
    return all;
}

// The faults of the plan, and which rows are of one.
struct Kind {
    const char* what;
    std::vector<const char*> names; // how theirs begin
};
const std::vector<Kind>& kinds() {
    static const std::vector<Kind> all{
        {"short read", {"short read"}},
        {"read of 0 bytes", {"empty read"}},
        {"status bytes alone", {"status alone"}},
        {"packet split at every offset", {"split at "}},
        {"packets that come together", {"two packets"}},
        {"flipped byte, each; flipped bits", {"flipped byte", "one bit in"}},
        {"dropped byte, each", {"dropped byte"}},
        {"inserted byte, each", {"inserted byte"}},
        {"stall", {"reads: refused by the device", "everything: refused by the device"}},
        {"overflow", {"reads: more bytes", "everything: more bytes"}},
        {"timeout",
         {"reads: timed", "everything: timed", "reads hang", "writes hang", "firmware hangs"}},
        {"EAGAIN storm", {"EAGAIN"}},
        {"refused, as where another process claims it",
         {"reads: refused by the system", "everything: refused by the system"}},
        {"gone, at each call; plugged in again", {"gone at"}},
        {"power lost and back", {"power"}},
        {"encoder stuck", {"encoders stuck"}},
        {"encoder jump", {"encoder jump"}},
        {"encoder wrap; angles of no place", {"no place"}},
        {"answers 1 to 50 ms late", {"answers "}},
        {"clock jump", {"clock"}},
    };
    return all;
}
size_t kind_of(const Row& row) {
    for (size_t i = 0; i < kinds().size(); ++i)
        for (const char* name : kinds()[i].names)
            if (row.name.starts_with(name))
                return i;
    return kinds().size();
}

enum class Phase { homing, idle, contact, drilling };

// Times of a run. After faults that take the device away, or time, there is time to open it anew.
struct Times {
    int64_t fault_ns = 300 * kMs, armed_ns = 550 * kMs, back_ns = 750 * kMs, end_ns = 900 * kMs;
};
Times times_of(const Row& row) {
    if (row.unplugs || row.clock_jump_ns || row.is_long)
        return {.armed_ns = 1'350 * kMs, .back_ns = 2'700 * kMs, .end_ns = 2'850 * kMs};
    return {};
}

// The hand of each phase: away from the wall, or in it from 0.2 s on and out of it after the fault,
// so that the soft start can begin again. At last it comes back.
HandPath path_of(Phase phase, const Times& times) {
    std::vector<HandPose> poses;
    const auto add = [&](int64_t at_ns, double z_mm) {
        poses.push_back(
            {.time_s = 1e-9 * static_cast<double>(at_ns), .tool = {.position_mm = {0, 0, z_mm}}});
    };
    add(0, 8);
    if (phase == Phase::contact || phase == Phase::drilling) {
        add(140 * kMs, 8);
        add(200 * kMs, -4);
        add(440 * kMs, -4);
        add(500 * kMs, 8);
    }
    add(times.back_ns, 8);
    add(times.back_ns + 60 * kMs, -4);
    return HandPath(std::move(poses));
}

class Run {
 public:
    Run(const Row& row, Phase phase)
        : row_(row),
          phase_(phase),
          times_(times_of(row)),
          bench_({.firmware = test_firmware(),
                  .is_homed = phase != Phase::homing,
                  .homing_packets = 150,
                  .path = path_of(phase, times_)}) {}

    void run() {
        loop_.emplace(std::move(bench_.open(test_firmware()).value()), bench_.clock, 500.0);
        if (phase_ == Phase::homing) {
            ASSERT_TRUE(loop_->loop.device->home());
        }
        if (phase_ == Phase::drilling)
            bench_.model.buttons = 1;
        const int64_t begins_ns = phase_ == Phase::homing ? 80 * kMs : times_.fault_ns;
        while (bench_.clock.now_ns() < begins_ns)
            ASSERT_NO_FATAL_FAILURE(tick());
        const bool is_pressed = phase_ == Phase::contact || phase_ == Phase::drilling;
        ASSERT_EQ(last_.sent.force_n.z > 0.3, is_pressed);

        begin();
        for (int i = 0; i < kFaultTicks; ++i) {
            if (row_.unplugs && i == row_.lasts) // after so many transfers, below
                bench_.transport->unplug();
            ASSERT_NO_FATAL_FAILURE(tick());
            if (i >= row_.lasts && !row_.unplugs)
                end();
        }
        if (row_.ends_force && is_pressed) {
            ASSERT_EQ(last_.sent, Wrench{});
            // The motors are off, too, if commands get through.
            if (!bench_.transport->gone() && !row_.fault && !bench_.model.silent) {
                ASSERT_EQ(bench_.model.command().motors, (Counts{}));
            }
        }
        end();
        ASSERT_NO_FATAL_FAILURE(recover());
    }

 private:
    void begin() {
        if (row_.fault)
            bench_.transport->set_fault(row_.fault());
        if (row_.device)
            row_.device(bench_.model, true);
        if (row_.clock_jump_ns)
            bench_.clock.sleep_until(bench_.clock.now_ns() + row_.clock_jump_ns);
    }
    void end() {
        if (!faulty_)
            return;
        faulty_ = false;
        bench_.transport->set_fault(nullptr);
        if (row_.device)
            row_.device(bench_.model, false);
    }

    // The hand leaves the wall, somebody arms again, and it comes back. A device that
    // is gone, or lost its homing, is opened anew.
    void recover() {
        const auto needs_opening = [&] {
            return last_.status == DeviceStatus::gone || !bench_.model.runs();
        };
        for (int i = 0; i < 20; ++i)
            ASSERT_NO_FATAL_FAILURE(tick());
        if (needs_opening()) {
            loop_.reset();
            if (row_.unplugs)
                bench_.model.plugged();
            const int64_t began_ns = bench_.clock.now_ns();
            Result<std::unique_ptr<FalconDevice>> again = bench_.open(test_firmware());
            ASSERT_TRUE(again) << again.error().message;
            ASSERT_LT(bench_.clock.now_ns() - began_ns, kBoot_ns);
            ASSERT_TRUE((*again)->home());
            loop_.emplace(std::move(*again), bench_.clock, 500.0);
            since_latch_ = silent_ = 0;
        }
        const int64_t armed_ns = std::max<int64_t>(bench_.clock.now_ns(), times_.armed_ns);
        bool armed = false;
        ASSERT_LT(bench_.clock.now_ns() + 200 * kMs, times_.end_ns);
        while (bench_.clock.now_ns() < times_.end_ns) {
            if (!armed && bench_.clock.now_ns() >= armed_ns) {
                loop_->loop.servo.arm();
                armed = true;
            }
            ASSERT_NO_FATAL_FAILURE(tick());
        }
        ASSERT_EQ(last_.status == DeviceStatus::ok || last_.status == DeviceStatus::stale, true);
        ASSERT_GT(last_.sent.force_n.z, 0.3) << fault_text(last_.faults);
        ASSERT_GT(bench_.model.motor_force_n().z, 0.3);
    }

    void tick() {
        if (phase_ == Phase::drilling) // the wall gives way from 1 mm on by 1 mm a second
            loop_->loop.scenes.publish(std::make_unique<const TouchScene>(
                TouchScene{.version = static_cast<uint64_t>(
                               std::max<int64_t>(0, 1000 - bench_.clock.now_ns() / kMs))}));
        const int64_t began_ns = bench_.clock.now_ns();
        last_ = loop_->tick();
        ASSERT_LT(bench_.clock.now_ns() - began_ns, kLongest_ns);
        const double size = glm::length(last_.sent.force_n);
        ASSERT_TRUE(std::isfinite(size));
        ASSERT_LE(size, 0.8 * kForce_n * (1 + 1e-9));
        for (const int count : bench_.model.command().motors)
            ASSERT_LE(std::abs(count), FalconDevice::kMostCounts);
        since_latch_ = last_.faults & kFaultLatched ? since_latch_ + 1 : 0;
        // A trip of speed ends within 20 ms, by the chain's own rule; all others at once.
        if (since_latch_ >= 2 && !(last_.faults & kFaultVelocity)) {
            ASSERT_EQ(last_.sent, Wrench{});
        }
        if (last_.status == DeviceStatus::ok)
            silent_ = 0;
        else if (silent_ == 0)
            silent_ = last_.now_ns;
        if (silent_ != 0 && last_.now_ns - silent_ > kSilence_ns + 2 * kMs) {
            ASSERT_EQ(last_.sent, Wrench{}) << last_.now_ns - silent_;
        }
    }

    const Row& row_;
    Phase phase_;
    Times times_;
    FalconBench bench_;
    std::optional<FalconLoop> loop_;
    ServoTick last_;
    bool faulty_ = true;
    int since_latch_ = 0;
    int64_t silent_ = 0; // since when there is no sample
};

// How many rows of each kind hold in a phase.
class Cells {
 public:
    void add(const Row& row, bool holds) {
        Cell& cell = cells_.at(kind_of(row));
        ++cell.all;
        cell.hold += holds;
    }
    void print(const char* phase) const {
        for (size_t i = 0; i < cells_.size(); ++i)
            fmt::print("| {} | {} | {} of {} |\n", kinds()[i].what, phase, cells_[i].hold,
                       cells_[i].all);
    }

 private:
    struct Cell {
        int all = 0, hold = 0;
    };
    std::vector<Cell> cells_ = std::vector<Cell>(kinds().size());
};

void run_phase(Phase phase, const char* name) {
    const std::vector<Row> all = rows();
    ASSERT_GT(all.size(), 80u);
    Cells cells;
    for (const Row& row : all) {
        SCOPED_TRACE(row.name);
        Run(row, phase).run();
        cells.add(row, !testing::Test::HasFailure());
    }
    cells.print(name);
}

// FalconFaults takes over 5 s of a processor: each fault comes in each phase of a run, and a run is
// tens of thousands of packets.
TEST(FalconFaults, EveryFaultOfThePlanHasRows) {
    std::vector<size_t> count(kinds().size());
    for (const Row& row : rows()) {
        ASSERT_LT(kind_of(row), kinds().size()) << row.name;
        ++count[kind_of(row)];
    }
    for (size_t i = 0; i < count.size(); ++i)
        EXPECT_GT(count[i], 0u) << kinds()[i].what;
}

TEST(FalconFaults, WhileHoming) {
    run_phase(Phase::homing, "homing");
}
TEST(FalconFaults, WhileIdle) {
    run_phase(Phase::idle, "idle");
}
TEST(FalconFaults, InContact) {
    run_phase(Phase::contact, "contact");
}
TEST(FalconFaults, WhileDrilling) {
    run_phase(Phase::drilling, "drilling");
}

// While firmware is loaded: it starts, or says in a sentence why not; in either case soon, and a
// device that is switched off and on starts afterwards.
TEST(FalconFaults, WhileStarting) {
    const std::vector<std::byte> image = test_firmware();
    const auto check = [&](const FakeTransport::Fault& fault,
                           const std::function<void(FalconBench&)>& before) {
        FalconBench bench({.firmware = image, .is_loaded = false});
        if (before)
            before(bench);
        const Result<std::unique_ptr<FalconDevice>> device = bench.open(image, fault);
        EXPECT_LT(bench.clock.now_ns(), kBoot_ns);
        if (!device) {
            EXPECT_EQ(device.error().message.find("Novint Falcon: "), 0u) << device.error().message;
        }
        bench.model.encoder_shift = {};
        bench.model.silent = false;
        bench.model.plugged();
        const Result<std::unique_ptr<FalconDevice>> again = bench.open(image);
        EXPECT_TRUE(again) << again.error().message;
        return !device;
    };
    Cells cells;
    for (const Row& row : rows()) {
        SCOPED_TRACE(row.name);
        if (row.fault)
            check(row.fault(), nullptr);
        if (row.device)
            check(nullptr, [&](FalconBench& bench) { row.device(bench.model, true); });
        if (row.clock_jump_ns) { // at its 100th transfer
            VirtualClock* clock = nullptr;
            int calls = 0;
            const auto jump = [&](Transfer&, int64_t now_ns) {
                if (++calls == 100)
                    clock->sleep_until(now_ns + row.clock_jump_ns);
            };
            check(jump, [&](FalconBench& bench) { clock = &bench.clock; });
        }
        if (row.unplugs) { // at the same call, counted from the first; others are below
            FalconBench* one = nullptr;
            int calls = 0;
            const auto unplug = [&](Transfer& t, int64_t) {
                if (++calls == row.lasts) {
                    one->transport->unplug();
                    t.status = TransferStatus::gone;
                }
            };
            EXPECT_TRUE(check(unplug, [&](FalconBench& bench) { one = &bench; }));
        }
        cells.add(row, !testing::Test::HasFailure());
    }
    // Unplugged at each of its transfers, of which there are about 300.
    int refused = 0;
    for (int call = 1; call < 300; call += 3) {
        SCOPED_TRACE(call);
        FalconBench bench({.firmware = image, .is_loaded = false});
        int calls = 0;
        const Result<std::unique_ptr<FalconDevice>> device =
            bench.open(image, [&](Transfer& t, int64_t) {
                if (++calls == call) {
                    bench.transport->unplug();
                    t.status = TransferStatus::gone;
                }
            });
        ASSERT_FALSE(device);
        EXPECT_NE(device.error().message.find("unplugged"), std::string::npos);
        ++refused;
        bench.model.plugged();
        ASSERT_TRUE(bench.open(image));
    }
    EXPECT_EQ(refused, 100);
    cells.print("boot");
}

} // namespace
} // namespace palpate::haptics::falcon
