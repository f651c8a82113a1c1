#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "engine/segment/methods.h"

namespace palpate::view {

// A person's wishes for a net on a server. A part of ViewState::own.
struct NetWish {
    std::string server{}; // as typed
    std::string model{};  // of MONAI Label; "": the only one
    // The server that may be sent the volume and the seeds: agreed for one name alone.
    std::string agreed{};

    bool is_agreed() const { return !server.empty() && agreed == server; }
    friend bool operator==(const NetWish&, const NetWish&) = default;
};

// The method of a net, beside those of the table. It takes seeds.
const SegmentMethod& net_method();
// A method of the table, or that; null for other names.
const SegmentMethod* find_method_or_net(std::string_view name);

// The state from which that method's next run takes the wish. Refused, in a sentence: no server,
// a name that is none, and a server that a person has not agreed to: then with the words of what
// would be sent.
Result<std::shared_ptr<KeptRun>> net_run(const NetWish& wish, const Volume& volume);

} // namespace palpate::view
