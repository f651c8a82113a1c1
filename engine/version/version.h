#pragma once

namespace palpate {

// The commit this program was built from, "-dirty" behind it where files had changed; "unknown"
// outside a checkout.
const char* built_from();

} // namespace palpate
