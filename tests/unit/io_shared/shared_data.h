#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "engine/io/volume_io.h"
#include "tests/support/paths.h"

namespace palpate {

inline const std::filesystem::path kShared = kSharedData;

class SharedData : public ::testing::Test {
 protected:
    void SetUp() override {
        if (!std::filesystem::is_directory(kShared))
            GTEST_SKIP() << "the folder of real data is absent: " << kShared.string();
    }

    static LoadedVolume loaded(const std::string& name, const ReadOptions& options = {}) {
        Result<LoadedVolume> result = load_volume(kShared / name, options);
        if (!result)
            throw std::runtime_error(result.error().message);
        return std::move(*result);
    }
};

} // namespace palpate
