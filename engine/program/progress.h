#pragma once

#include <string>

namespace palpate {

// A line on standard error that says how far some work is, while standard error is a terminal;
// nothing else. Gone when this is.
class Progress {
 public:
    explicit Progress(std::string what);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void show(double share); // 0 .. 1

 private:
    std::string what_;
    bool terminal_;
    int shown_percent_ = -1;
};

} // namespace palpate
