#include "haptics/device/transport/plugged.h"

#include <fmt/format.h>
#include <string.h>
#include <unistd.h>

#include <cerrno>

namespace palpate::haptics {

std::string refusal_of_node(const std::string& node, int error) {
    return fmt::format("{}: {}", node,
                       error == EACCES || error == EPERM
                           ? "no permission; install Palpate's udev rules (70-palpate.rules) and "
                             "plug the device in again"
                           : ::strerror(error));
}

std::string refusal_of_node(const std::string& node) {
    return ::access(node.c_str(), R_OK | W_OK) == 0 ? "" : refusal_of_node(node, errno);
}

} // namespace palpate::haptics
