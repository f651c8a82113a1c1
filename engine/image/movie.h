#pragma once

#include <filesystem>
#include <stop_token>

#include "engine/base/error.h"

namespace palpate {

// Movies are made by the program ffmpeg, where it is on $PATH. An error says that it is not.
Result<void> expect_movie_encoder();

// The name of a frame in the folder that make_movie() reads: "000007.png".
std::filesystem::path movie_frame_name(size_t number);

// An MP4 (H.264, 4:2:0) of the frames 0, 1, .. of a folder, all of one size; an odd side is
// widened by a black pixel. The file appears whole or not at all. An error has ffmpeg's exit
// status.
Result<void> make_movie(const std::filesystem::path& frames, double frames_per_s,
                        const std::filesystem::path& path, const std::stop_token& stop = {});

} // namespace palpate
