#include "haptics/sound/player.h"

namespace palpate::haptics {

Result<std::unique_ptr<SoundPlayer>> SoundPlayer::open() {
    return fail(
        "sound is left out of this build, because OpenAL was not installed; Debian's "
        "package is libopenal-dev");
}

} // namespace palpate::haptics
