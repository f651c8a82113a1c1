#pragma once

#include <optional>
#include <string>

#include "engine/decode/formats.h"

namespace palpate::io {

// Names a format that is known and not read: what it is, and what to do instead ("is GIPL, which is
// not read; convert it ..."). Told by its extension, or by a mark in its first bytes.
std::optional<std::string> why_not_read(const FileHead& head);

} // namespace palpate::io
