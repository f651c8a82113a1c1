#include "engine/base/assert.h"

#include <cstdio>
#include <cstdlib>

namespace palpate {

void assertion_failed(const char* condition, const std::string& values, const char* file,
                      int line) {
    std::fprintf(stderr, "%s:%d: broken assertion: %s%s%s\n", file, line, condition,
                 values.empty() ? "" : ", with ", values.c_str());
    std::abort();
}

} // namespace palpate
