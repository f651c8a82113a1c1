#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// Writes a file whole or not at all.
//
// `write(temporary)` fills a file of another name in the same folder; when it succeeds the file is
// synced and renamed to `path`, else (also when it throws) it is removed. A program killed in
// between leaves at most the temporary file, named ".<process>.tmp.<name>", never a partial `path`.
// The temporary name ends as `path` does, because some writers choose the format by it. Where
// `path` is a link to a file, that file is written, and the link stays.
Result<void> write_atomically(
    const std::filesystem::path& path,
    const std::function<Result<void>(const std::filesystem::path& temporary)>& write);

// Files that appear together or not at all, for a command that writes several.
//
// While one lives, the files of write_atomically() are whole and on disk, but keep their temporary
// names until commit() gives them their own, in the order in which they were written. Without a
// commit() they are removed, and what had those names stays. The newest of several takes the files.
// Of the whole process: writes may come from any thread.
class FilesTogether {
 public:
    FilesTogether();
    ~FilesTogether();
    FilesTogether(const FilesTogether&) = delete;
    FilesTogether& operator=(const FilesTogether&) = delete;

    // Later files are not among these. Call it for the newest.
    void close();

    // An error names the first file that cannot take its name; those behind it are removed. May be
    // called again for files that were written since.
    Result<void> commit();
    // commit() of the newest; nothing where there is none. For what shall stay whatever follows.
    static Result<void> commit_newest();

    // The file that holds what was written to `path`: a temporary one before commit().
    static std::filesystem::path written(const std::filesystem::path& path);

 private:
    friend Result<void> write_atomically(
        const std::filesystem::path& path,
        const std::function<Result<void>(const std::filesystem::path& temporary)>& write);
    struct File {
        std::filesystem::path temporary, path;
    };
    void remove_files();

    FilesTogether* outer_;
    bool open_ = true;
    std::vector<File> files_;
};

// The same as write_atomically() for bytes at hand.
Result<void> save_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes);

// A whole text file; refused when larger than `limit_bytes` or not a regular file.
Result<std::string> load_text(const std::filesystem::path& path, uint64_t limit_bytes = 64 << 20);

} // namespace palpate
