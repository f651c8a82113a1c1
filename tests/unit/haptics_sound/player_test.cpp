#include "haptics/sound/player.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/support/temporary_folder.h"

namespace palpate::haptics {
namespace {

class Player : public TemporaryFolder {};

// OpenAL Soft writes what it plays to a file instead of playing it, so that no sound output is
// needed.
TEST_F(Player, PlaysWhileMaterialGoesAndEndsByItself) {
    const auto wave = file("played.wav"), settings = file("alsoft.conf");
    std::ofstream(settings) << "drivers = wave\n[wave]\nfile = " << wave.string() << "\n";
    setenv("ALSOFT_CONF", settings.c_str(), 1);
    setenv("ALSOFT_DRIVERS", "wave", 1);
    {
        auto player = SoundPlayer::open();
        if (!player && player.error().message.find("left out of this build") != std::string::npos)
            GTEST_SKIP() << player.error().message;
        ASSERT_TRUE(player) << player.error().message;
        for (uint64_t buffers = 1; buffers <= 30; ++buffers) { // told anew for each, as by frames
            (*player)->set({.rate_mm3_per_s = 300.0, .hardness = 1.0, .speed_mm_per_s = 10.0});
            (*player)->wait_until_played(buffers);
        }
        EXPECT_GE((*player)->buffers_played(), 30u);
    }
    const std::string bytes = bytes_of("played.wav");
    ASSERT_GT(bytes.size(), 20000u);
    size_t loud = 0;
    for (size_t i = 200; i < bytes.size(); ++i)
        loud += bytes[i] != 0;
    EXPECT_GT(loud, bytes.size() / 10);
}

} // namespace
} // namespace palpate::haptics
