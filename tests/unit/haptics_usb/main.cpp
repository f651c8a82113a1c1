#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/with_umockdev.h"

// For the address sanitizer. umockdev-wrapper is loaded before its library. A request that flies
// while an imitated device is unplugged never ends, and libusb keeps it until it does; a real
// kernel ends it. Whose memory it is shows in whole call stacks.
extern "C" __attribute__((visibility("default"))) const char* __asan_default_options() {
    return "verify_asan_link_order=0:fast_unwind_on_malloc=0";
}
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions() {
    return "leak:libusb_submit_transfer\n";
}

int main(int argc, char** argv) {
    palpate::haptics::run_with_umockdev(argv);
    ::testing::InitGoogleMock(&argc, argv);
    return RUN_ALL_TESTS();
}
