#include "engine/decode/dicom_walk.h"

#include <gdcmReader.h>

#include <algorithm>
#include <fstream>

#include "engine/decode/dicom_elements.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

using gdcm::Tag;

constexpr int kMostFolders = 16;
constexpr size_t kMostFiles = 200000;
constexpr size_t kMostWarnings = 8;
constexpr size_t kPreambleBytes = 132;
constexpr const char* kDirectoryClass = "1.2.840.10008.1.3.10";

bool looks_like_dicom_file(const fs::path& path) {
    std::string head(kPreambleBytes, '\0');
    std::ifstream in(path, std::ios::binary);
    in.read(head.data(), kPreambleBytes);
    head.resize(static_cast<size_t>(in.gcount()));
    return looks_like_dicom(head, lower_case(path.extension().string()));
}

// Calls take(path) for each regular file, until it returns false. What cannot be opened is left
// out. Returns what the limits left out, in words.
template <class Take>
std::string walk(const fs::path& folder, const VoxelSink& sink, const Take& take) {
    std::string limited;
    size_t files = 0;
    std::error_code error;
    fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied,
                                        error);
    for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
        std::error_code ignored;
        if (at.depth() >= kMostFolders && at->is_directory(ignored)) {
            limited = fmt::format("folders more than {} deep are left out", kMostFolders);
            at.disable_recursion_pending();
        }
        if (!at->is_regular_file(ignored))
            continue;
        if (files % 256 == 0)
            sink.alive();
        if (++files > kMostFiles)
            return fmt::format("files beyond the first {} are left out", kMostFiles);
        if (!take(at->path()))
            return limited;
    }
    return limited;
}

// A part of a path as DICOM media name it is in capitals; systems show some in small letters, and
// with a version.
fs::path spelled(const fs::path& folder, const std::string& part) {
    for (const std::string& name : {part, lower_case(part), part + ";1", lower_case(part) + ";1"})
        if (fs::exists(folder / name))
            return folder / name;
    return {};
}

// The file that a directory record names; empty where it does not exist, or would lie outside.
fs::path referenced_file(const fs::path& folder, const std::vector<std::string>& parts) {
    fs::path at = folder;
    for (const std::string& part : parts) {
        if (part.empty() || part == "." || part == ".." || part.find('/') != std::string::npos)
            return {};
        at = spelled(at, part);
        if (at.empty())
            return {};
    }
    std::error_code error;
    return !parts.empty() && fs::is_regular_file(at, error) ? at : fs::path();
}

// The files that a DICOMDIR names. Absent where the file is none.
std::optional<std::vector<fs::path>> files_of_directory(const fs::path& path,
                                                        std::vector<std::string>& warnings) {
    gdcm::Reader reader;
    reader.SetFileName(path.c_str());
    if (!reader.Read() ||
        text(reader.GetFile().GetHeader(), Tag(0x0002, 0x0002)) != kDirectoryClass)
        return {};
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    std::vector<fs::path> files;
    size_t named = 0;
    const DicomItems records(reader.GetFile().GetDataSet(), Tag(0x0004, 0x1220));
    for (size_t i = 0; const DicomItem record = records.at(i); ++i) {
        const std::vector<std::string> parts = texts(*record, Tag(0x0004, 0x1500));
        if (parts.empty())
            continue;
        ++named;
        if (const fs::path file = referenced_file(folder, parts); !file.empty())
            files.push_back(file);
    }
    if (files.size() < named)
        warnings.push_back(fmt::format("{}: {} of the {} files that it names are not there",
                                       path.string(), named - files.size(), named));
    return files;
}

void read_header(const fs::path& path, const DecodeRequest& request, const VoxelSink& sink,
                 DicomFiles& found) {
    const auto& without = request.without;
    if (std::find(without.begin(), without.end(), path) != without.end())
        return set_aside(found, path, "the reader crashed or got nowhere in it");
    sink.alive(path);
    Result<DicomFile> file = read_dicom_header(path);
    if (file)
        found.files.emplace(path, std::move(*file));
    else
        set_aside(found, path, file.error().message);
}

Result<DicomFiles> read_one(const DecodeRequest& request, const VoxelSink& sink) {
    const fs::path& path = request.path;
    DicomFiles found;
    PALPATE_TRY(DicomFile file, read_dicom_header(path));
    if (file.refusal.empty()) {
        found.files.emplace(path, std::move(file));
        return found;
    }
    const auto named = files_of_directory(path, found.warnings);
    if (!named)
        return fail("{}: {}", path.string(), file.refusal);
    for (const fs::path& one : *named)
        read_header(one, request, sink, found);
    if (found.files.empty())
        return fail("{}: none of the files that it names can be read{}", path.string(),
                    found.warnings.empty() ? "" : "; " + found.warnings.front());
    return found;
}

} // namespace

bool holds_dicom(const fs::path& folder, const VoxelSink& sink) {
    bool found = false;
    walk(folder, sink, [&](const fs::path& path) {
        found = looks_like_dicom_file(path);
        return !found;
    });
    return found;
}

void set_aside(DicomFiles& found, const fs::path& path, const std::string& why) {
    // Messages begin with the file's name.
    const std::string start = path.string() + ": ";
    const std::string reason = why.starts_with(start) ? why.substr(start.size()) : why;
    if (++found.damaged <= kMostWarnings)
        found.warnings.push_back(fmt::format("{}: is passed over: {}", path.string(), reason));
    else if (found.damaged == kMostWarnings + 1)
        found.warnings.push_back("more damaged files are passed over");
    found.files.erase(path);
}

Result<DicomFiles> read_dicom_headers(const DecodeRequest& request, const VoxelSink& sink) {
    const std::string name = request.path.string();
    if (!fs::is_directory(request.path))
        return read_one(request, sink);
    DicomFiles found;
    size_t others = 0;
    std::string example;
    const std::string limited = walk(request.path, sink, [&](const fs::path& path) {
        if (looks_like_dicom_file(path)) {
            read_header(path, request, sink, found);
        } else if (const std::string file = path.lexically_relative(request.path).string();
                   ++others == 1 || file < example) {
            example = file;
        }
        return true;
    });
    if (!limited.empty())
        found.warnings.push_back(fmt::format("{}: {}", name, limited));
    if (others > 0)
        found.notes.push_back(fmt::format("{}: {} file{} {} no DICOM, such as {}", name, others,
                                          others == 1 ? "" : "s", others == 1 ? "is" : "are",
                                          example));
    if (found.files.empty())
        return fail("{}: holds no DICOM image that can be read{}", name,
                    found.warnings.empty() ? "" : "; " + found.warnings.front());
    // A directory of the others beside it.
    std::erase_if(found.files, [](const auto& entry) {
        return entry.second.refusal.find("(DICOMDIR)") != std::string::npos;
    });
    if (found.files.empty())
        return fail("{}: holds no DICOM image beside its DICOMDIR", name);
    return found;
}

} // namespace palpate::io
