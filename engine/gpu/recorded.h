#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/command_slot.h"
#include "engine/gpu/commands.h"

namespace palpate {

// The passes and results of one submission. For commands.cpp and ticket.cpp alone.
struct Recorded {
    struct Pass {
        std::string name;
        uint64_t copied_bytes = 0;   // of a copy, which the profile shows among the copies
        std::string first_uses = {}; // pipelines that had not been dispatched before
        bool for_profile_alone = false;
    };
    struct Part { // one submission
        std::unique_ptr<CommandSlot> slot;
        std::vector<Pass> passes{};
        uint64_t value = 0;       // of the timeline; 0 before its submission
        int64_t submitted_ns = 0; // while a profile is recorded
        std::vector<PassTime> times{};
        bool has_times = false;
    };
    explicit Recorded(GpuDevice& by) : device(&by) {}
    Recorded(const Recorded&) = delete;
    Recorded& operator=(const Recorded&) = delete;
    ~Recorded() {
        uploads.give(*device, last_value());
        read_backs.give(*device, last_value());
        for (Part& part : parts)
            if (part.slot)
                device->give_slot(std::move(part.slot), part.value);
    }
    uint64_t last_value() const { // of a submission so far
        uint64_t last = 0;
        for (const Part& part : parts)
            last = std::max(last, part.value);
        return last;
    }
    Part& open() { return parts.back(); }
    bool is_open() const { return !parts.empty() && parts.back().value == 0; }
    void read_times(Part& part) const; // of one that the device is past
    void profile_passes(const Part& part, std::span<const uint64_t> stamps) const;

    GpuDevice* device;
    std::vector<Part> parts;
    Staging uploads{Memory::upload}, read_backs{Memory::read_back}; // for all parts
    bool submitted = false;                                         // by Commands::submit()
};

} // namespace palpate
