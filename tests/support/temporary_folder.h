#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace palpate {

// A folder of the running test alone; removed with everything in it.
class TemporaryFolder : public testing::Test {
 protected:
    TemporaryFolder() {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = std::filesystem::temp_directory_path() /
                  (std::string("palpate.") + test->test_suite_name() + "." + test->name() + "." +
                   std::to_string(::getpid()));
        std::filesystem::create_directories(folder_);
    }
    ~TemporaryFolder() override { std::filesystem::remove_all(folder_); }

    std::filesystem::path file(const std::string& name) const { return folder_ / name; }

    std::string bytes_of(const std::string& name) const {
        std::ifstream in(file(name), std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    void write(const std::string& name, const std::string& bytes) const {
        std::filesystem::remove(file(name)); // ext4 flushes a file that is cut short and rewritten
        std::ofstream(file(name), std::ios::binary) << bytes;
    }

 private:
    std::filesystem::path folder_;
};

} // namespace palpate
