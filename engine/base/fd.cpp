#include "engine/base/fd.h"

#include <unistd.h>

#include <cerrno>

namespace palpate {

namespace {

// write(bytes) is one call of the system; its interruption by a signal is no failure.
template <class Write>
bool write_parts(std::span<const std::byte> bytes, const Write& write) {
    while (!bytes.empty()) {
        const ssize_t done = write(bytes);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return false;
        bytes = bytes.subspan(static_cast<size_t>(done));
    }
    return true;
}

} // namespace

Fd::~Fd() {
    const int reason = errno;
    if (fd_ >= 0)
        ::close(fd_);
    errno = reason;
}

bool write_all(const Fd& fd, std::span<const std::byte> bytes) {
    return write_parts(bytes,
                       [&](auto part) { return ::write(fd.get(), part.data(), part.size()); });
}

bool write_all_at(const Fd& fd, std::span<const std::byte> bytes, off_t at) {
    const std::byte* const begin = bytes.data();
    return write_parts(bytes, [&](auto part) {
        return ::pwrite(fd.get(), part.data(), part.size(), at + (part.data() - begin));
    });
}

} // namespace palpate
