#include "engine/base/memory_limit.h"

#include <array>

#include "engine/base/memory.h"
#include "engine/base/option_name.h"

namespace palpate {

namespace {

std::string bytes_text(double bytes) {
    constexpr std::array kUnits{"bytes", "KiB", "MiB", "GiB", "TiB", "PiB"};
    size_t unit = 0;
    for (; bytes >= 1024.0 && unit + 1 < kUnits.size(); ++unit)
        bytes /= 1024.0;
    return fmt::format("{:.3g} {}", bytes, kUnits[unit]);
}

} // namespace

Result<void> expect_memory(const std::string& what, double bytes, uint64_t limit_bytes) {
    const uint64_t usable = physical_memory_bytes() / 4 * 3;
    const bool is_usable = limit_bytes == 0 || limit_bytes == usable;
    const auto limit = static_cast<double>(is_usable ? usable : limit_bytes);
    if (bytes <= limit)
        return {};
    return fail("{}: needs {} of memory, and the limit is {} ({})", what, bytes_text(bytes),
                bytes_text(limit),
                is_usable ? "75 % of this machine's memory" : text_of(Option{"max-memory"}));
}

} // namespace palpate
