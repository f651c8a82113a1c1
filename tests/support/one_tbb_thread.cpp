// Linked into tests that run under the thread sanitizer: oneTBB keeps to the thread that asks.
//
// Debian's oneTBB is not built for the sanitizer, which therefore does not see that a task's end
// comes before what follows its group, and reports races between the two. Nothing is checked inside
// of such tasks either way; threads of our own are.

#include <tbb/global_control.h>

namespace {

[[maybe_unused]] const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism,
                                                      1);

} // namespace
