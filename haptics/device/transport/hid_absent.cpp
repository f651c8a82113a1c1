#include "haptics/device/transport/hid.h"

// In place of hid.cpp where hidapi was not there when Palpate was built.
namespace palpate::haptics {

const char* hid_refusal() noexcept {
    return "Palpate was built without hidapi (libhidapi-dev)";
}

std::vector<Plugged> plugged_hid() {
    return {};
}

std::vector<std::byte> report_descriptor(const std::string&) {
    return {};
}

Result<std::unique_ptr<Transport>> open_hid(const std::string& node) {
    return fail("{}: {}", node, hid_refusal());
}

} // namespace palpate::haptics
