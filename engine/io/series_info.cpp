#include "engine/io/series_info.h"

#include <fmt/format.h>

namespace palpate {

std::string series_line(const SeriesInfo& series) {
    const std::string description =
        series.description.empty() ? "" : fmt::format(" '{}'", series.description);
    return fmt::format("series {} of {}: {}{}, {}, {}{}", series.number, series.count,
                       series.modality, description, series.content, series.uid,
                       series.is_read ? " (read)" : "");
}

} // namespace palpate
