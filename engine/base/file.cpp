#include "engine/base/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <mutex>
#include <utility>

#include "engine/base/fd.h"
#include "engine/base/writable.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

std::mutex g_together_mutex; // of what follows and of the files in it
FilesTogether* g_together = nullptr;

Result<void> rename_to(const fs::path& temporary, const fs::path& path) {
    std::error_code renamed, ignored;
    fs::rename(temporary, path, renamed);
    if (!renamed)
        return {};
    fs::remove(temporary, ignored);
    return fail("{}: cannot be written: {}", path.string(), renamed.message());
}

Result<void> sync_to_disk(const fs::path& path) {
    const Fd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!fd)
        return fail("{}: cannot be read back: {}", path.string(), std::strerror(errno));
    if (::fsync(fd.get()) != 0)
        return fail("{}: cannot be written to disk: {}", path.string(), std::strerror(errno));
    return {};
}

} // namespace

Result<void> expect_writable(const fs::path& path) {
    std::error_code ignored;
    // /dev/stdout leads to /proc/self/fd/1 and on to whatever that is, a file perhaps.
    if (fs::is_symlink(path, ignored) &&
        fs::read_symlink(path, ignored).string().starts_with("/proc/"))
        return fail("{}: cannot be written: expected a file, found a stream of this process",
                    path.string());
    // Anything but a file would be replaced by one: /dev/null too, where the user may.
    if (const fs::file_status there = fs::status(path, ignored);
        fs::exists(there) && !fs::is_regular_file(there))
        return fail("{}: cannot be written: expected a file, found a folder or device",
                    path.string());
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
        return fail("{}: cannot be written: {}", path.string(), std::strerror(errno));
    return {};
}

Result<void> write_atomically(const fs::path& asked,
                              const std::function<Result<void>(const fs::path&)>& write) {
    PALPATE_TRY(expect_writable(asked));
    std::error_code ignored;
    fs::path path = asked;
    if (fs::is_symlink(asked, ignored) && fs::exists(asked, ignored)) {
        path = fs::canonical(asked, ignored);
        PALPATE_TRY(expect_writable(path));
    }
    fs::path temporary = path;
    temporary.replace_filename(fmt::format(".{}.tmp.{}", ::getpid(), path.filename().string()));
    Result<void> written;
    try {
        written = write(temporary);
    } catch (...) { // what is written comes from a file that proves to be damaged, say
        fs::remove(temporary, ignored);
        throw;
    }
    if (written)
        written = sync_to_disk(temporary);
    if (!written) {
        fs::remove(temporary, ignored);
        return written;
    }
    {
        const std::scoped_lock held(g_together_mutex);
        if (g_together) {
            std::vector<FilesTogether::File>& files = g_together->files_;
            // One that is written again has the same temporary name.
            std::erase_if(files, [&](const auto& file) { return file.path == path; });
            files.push_back({temporary, path});
            return {};
        }
    }
    return rename_to(temporary, path);
}

FilesTogether::FilesTogether() {
    const std::scoped_lock held(g_together_mutex);
    outer_ = std::exchange(g_together, this);
}

FilesTogether::~FilesTogether() {
    const std::scoped_lock held(g_together_mutex);
    remove_files();
    if (open_)
        g_together = outer_;
}

void FilesTogether::close() {
    const std::scoped_lock held(g_together_mutex);
    if (std::exchange(open_, false))
        g_together = outer_;
}

void FilesTogether::remove_files() {
    std::error_code ignored;
    for (const File& file : files_)
        fs::remove(file.temporary, ignored);
    files_.clear();
}

Result<void> FilesTogether::commit() {
    const std::scoped_lock held(g_together_mutex);
    Result<void> done;
    for (size_t i = 0; done && i < files_.size(); ++i) // before the first takes its name
        done = expect_writable(files_[i].path);
    for (size_t i = 0; done && i < files_.size(); ++i)
        done = rename_to(files_[i].temporary, files_[i].path);
    if (done)
        files_.clear();
    remove_files();
    return done;
}

Result<void> FilesTogether::commit_newest() {
    FilesTogether* newest = nullptr;
    {
        const std::scoped_lock held(g_together_mutex);
        newest = g_together;
    }
    return newest ? newest->commit() : Result<void>();
}

fs::path FilesTogether::written(const fs::path& path) {
    const std::scoped_lock held(g_together_mutex);
    std::error_code ignored;
    const fs::path whole = fs::weakly_canonical(path, ignored);
    for (const FilesTogether* one = g_together; one; one = one->outer_)
        for (const File& file : one->files_)
            if (fs::weakly_canonical(file.path, ignored) == whole)
                return file.temporary;
    return path;
}

Result<void> save_bytes(const fs::path& path, std::span<const std::byte> bytes) {
    return write_atomically(path, [&](const fs::path& temporary) -> Result<void> {
        std::ofstream out(temporary, std::ios::binary);
        out.write(reinterpret_cast<const char*>(bytes.data()),
                  static_cast<std::streamsize>(bytes.size()));
        out.close();
        if (!out)
            return fail("{}: cannot be written: {}", path.string(), std::strerror(errno));
        return {};
    });
}

Result<std::string> load_text(const fs::path& path, uint64_t limit_bytes) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status))
        return fail("{}: no such file", path.string());
    if (!fs::is_regular_file(status))
        return fail("{}: expected a file, found a folder or device", path.string());
    const uint64_t size = fs::file_size(path, error);
    if (error)
        return fail("{}: cannot be read: {}", path.string(), error.message());
    if (size > limit_bytes)
        return fail("{}: expected at most {} bytes, found {}", path.string(), limit_bytes, size);
    std::string text(size, '\0');
    std::ifstream in(path, std::ios::binary);
    in.read(text.data(), static_cast<std::streamsize>(size));
    if (!in || static_cast<uint64_t>(in.gcount()) != size)
        return fail("{}: cannot be read whole: expected {} bytes, found {}", path.string(), size,
                    in.gcount());
    return text;
}

} // namespace palpate
