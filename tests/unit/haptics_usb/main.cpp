#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/with_umockdev.h"

int main(int argc, char** argv) {
    palpate::haptics::run_with_umockdev(argv);
    ::testing::InitGoogleMock(&argc, argv);
    return RUN_ALL_TESTS();
}
