#include "engine/base/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace palpate {

namespace {
constexpr uint64_t kMostResident = 64 << 20;
}

Result<MappedFile> MappedFile::open(const std::filesystem::path& path) {
    // A pipe must not wait.
    MappedFile file(Fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)));
    if (!file.fd_)
        return fail("{}: cannot be opened: {}", path.string(), std::strerror(errno));
    struct stat status {};
    if (::fstat(file.fd_.get(), &status) != 0)
        return fail("{}: cannot be read: {}", path.string(), std::strerror(errno));
    if (!S_ISREG(status.st_mode))
        return fail("{}: expected a file, found a folder or device", path.string());
    const auto size = static_cast<size_t>(status.st_size);
    if (size > 0) {
        void* mapped = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file.fd_.get(), 0);
        if (mapped == MAP_FAILED)
            return fail("{}: cannot be mapped into memory: {}", path.string(),
                        std::strerror(errno));
        file.bytes_ = {static_cast<const std::byte*>(mapped), size};
    }
    return file;
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : fd_(std::move(other.fd_)), bytes_(std::exchange(other.bytes_, {})) {}

MappedFile::~MappedFile() {
    if (!bytes_.empty())
        ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

bool MappedFile::is_whole(uint64_t& now_bytes) const {
    struct stat status {};
    if (::fstat(fd_.get(), &status) != 0)
        return false;
    now_bytes = static_cast<uint64_t>(status.st_size);
    return now_bytes == bytes_.size();
}

void MappedFile::count_read(uint64_t bytes) const {
    if (read_since_.fetch_add(bytes) + bytes < kMostResident)
        return;
    read_since_ = 0;
    ::madvise(const_cast<std::byte*>(bytes_.data()), bytes_.size(), MADV_DONTNEED);
}

} // namespace palpate
