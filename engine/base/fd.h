#pragma once

#include <sys/types.h>

#include <cstddef>
#include <span>
#include <utility>

namespace palpate {

// Owns a file descriptor of the system and closes it; below 0 is none. Closing leaves errno as it
// was, so that a reason can be told afterwards.
class Fd {
 public:
    explicit Fd(int fd = -1) : fd_(fd) {}
    Fd(Fd&& other) noexcept : fd_(other.release()) {}
    Fd& operator=(Fd&& other) noexcept {
        std::swap(fd_, other.fd_);
        return *this;
    }
    ~Fd();

    int get() const { return fd_; }
    explicit operator bool() const { return fd_ >= 0; }

    // Gives it out of hand.
    int release() { return std::exchange(fd_, -1); }

 private:
    int fd_;
};

// Writes all bytes, at the place where the file stands or from byte `at` on. False with the reason
// in errno; some of the bytes may then be written.
bool write_all(const Fd& fd, std::span<const std::byte> bytes);
bool write_all_at(const Fd& fd, std::span<const std::byte> bytes, off_t at);

} // namespace palpate
