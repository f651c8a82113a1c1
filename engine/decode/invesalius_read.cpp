#include <archive.h>
#include <archive_entry.h>

#include <cmath>
#include <memory>
#include <pugixml.hpp>

#include "engine/decode/affine.h"
#include "engine/decode/formats.h"
#include "engine/io/text_header.h"

// InVesalius project files: a tar archive, usually gzipped, of main.plist (an XML property list)
// and matrix.dat (the voxels), beside masks and surfaces, which are not read.
namespace palpate::io {

namespace fs = std::filesystem;

namespace {

constexpr size_t kBlockBytes = 1 << 16;
constexpr uint64_t kMostPlistBytes = 1 << 20;

// One walk through the members of an archive. Nothing is ever unpacked to disk, so a member's
// name cannot lead anywhere.
class Archive {
 public:
    explicit Archive(const fs::path& path) : name_(path.string()), archive_(archive_read_new()) {
        archive_read_support_filter_gzip(archive_.get());
        archive_read_support_format_tar(archive_.get());
        open_ =
            archive_read_open_filename(archive_.get(), name_.c_str(), kBlockBytes) == ARCHIVE_OK;
    }

    // Goes to the regular member of that last path component and returns its size; an error where
    // there is none, or the archive is damaged before it.
    Result<uint64_t> find(const std::string& member) {
        while (open_) {
            archive_entry* entry = nullptr;
            const int status = archive_read_next_header(archive_.get(), &entry);
            if (status == ARCHIVE_EOF)
                return fail("{}: expected a member {} in the project, found none", name_, member);
            if (status != ARCHIVE_OK)
                break;
            const char* const path = archive_entry_pathname(entry);
            if (!path || fs::path(path).filename() != member ||
                archive_entry_filetype(entry) != AE_IFREG)
                continue;
            if (!archive_entry_size_is_set(entry) || archive_entry_size(entry) < 0)
                break;
            return static_cast<uint64_t>(archive_entry_size(entry));
        }
        return damaged();
    }

    // Exactly out.size() bytes of the member found.
    Result<void> read(std::span<std::byte> out) {
        size_t done = 0;
        while (done < out.size()) {
            const la_ssize_t got =
                archive_read_data(archive_.get(), out.data() + done, out.size() - done);
            if (got <= 0)
                return damaged();
            done += static_cast<size_t>(got);
        }
        return {};
    }

    bool is_packed() const { return archive_filter_code(archive_.get(), 0) != ARCHIVE_FILTER_NONE; }

 private:
    struct Close {
        void operator()(archive* a) const { archive_read_free(a); }
    };

    tl::unexpected<Error> damaged() const {
        const char* const reason = archive_error_string(archive_.get());
        return fail(
            "{}: expected a tar archive, as InVesalius writes it; it is damaged or cut "
            "off{}{}",
            name_, reason ? ": " : "", reason ? reason : "");
    }

    std::string name_;
    std::unique_ptr<archive, Close> archive_;
    bool open_ = false;
};

// The value that follows <key>name</key> in a <dict>; empty when there is none.
pugi::xml_node value_of(pugi::xml_node dict, std::string_view name) {
    for (const pugi::xml_node key : dict.children("key"))
        if (key.text().get() == name)
            return key.next_sibling();
    return {};
}

std::vector<std::optional<double>> numbers_of(pugi::xml_node array) {
    std::vector<std::optional<double>> numbers;
    for (const pugi::xml_node item : array.children())
        numbers.push_back(parse_double(item.text().get()));
    return numbers;
}

struct Project {
    std::string matrix_file;
    ComponentType type{};
    glm::uvec3 size{1};
    glm::dvec3 spacing_mm{};
    std::string modality;
    int orientation = 1; // of the slices as acquired; 1 is axial
};

Result<ComponentType> numpy_type(const std::string& name, std::string_view dtype) {
    constexpr TypeKey<std::string_view> types[] = {
        {"int8", ComponentType::i8},     {"uint8", ComponentType::u8},
        {"int16", ComponentType::i16},   {"uint16", ComponentType::u16},
        {"int32", ComponentType::i32},   {"uint32", ComponentType::u32},
        {"float32", ComponentType::f32}, {"float64", ComponentType::f64}};
    if (const auto type = find_type(types, dtype))
        return *type;
    return fail("{}: expected a dtype of numbers in main.plist, found \"{}\"", name, dtype);
}

Result<Project> parse_project(const std::string& name, const std::string& plist) {
    pugi::xml_document document;
    if (const pugi::xml_parse_result parsed = document.load_buffer(plist.data(), plist.size());
        !parsed)
        return fail("{}: its main.plist is no property list: {}", name, parsed.description());
    const pugi::xml_node root = document.child("plist").child("dict");
    const pugi::xml_node matrix = value_of(root, "matrix");
    Project project;
    project.matrix_file = value_of(matrix, "filename").text().get();
    if (project.matrix_file.empty() || project.matrix_file == ".." ||
        project.matrix_file.find('/') != std::string::npos)
        return fail("{}: expected the plain name of a member as matrix file, found \"{}\"", name,
                    project.matrix_file);
    PALPATE_TRY(project.type, numpy_type(name, value_of(matrix, "dtype").text().get()));
    const auto shape = numbers_of(value_of(matrix, "shape")); // slowest first
    const auto spacing = numbers_of(value_of(root, "spacing"));
    if (shape.size() != 3 || spacing.size() != 3)
        return fail(
            "{}: expected a shape and a spacing of 3 numbers in main.plist, found {} and "
            "{}",
            name, shape.size(), spacing.size());
    for (int axis = 0; axis < 3; ++axis) {
        const std::optional<double> size = shape[static_cast<size_t>(2 - axis)];
        if (!size || !(*size >= 1 && *size <= INT32_MAX) || *size != std::floor(*size))
            return fail("{}: expected a shape of whole numbers of 1 or more in main.plist", name);
        project.size[axis] = static_cast<uint32_t>(*size);
        const std::optional<double> step = spacing[static_cast<size_t>(axis)];
        if (!step || !(*step > 0))
            return fail("{}: expected spacings above 0 in main.plist", name);
        project.spacing_mm[axis] = *step;
    }
    project.modality = value_of(root, "modality").text().get();
    project.orientation = value_of(root, "orientation").text().as_int(1);
    return project;
}

// The project says nothing of where the voxels lie in the patient, InVesalius does: its importer
// (invesalius/data/imagedata_utils.py, dcm2memmap) turns every slice upside down and stacks the
// slices from the feet up. Rows of an axial DICOM slice run to the patient's left and follow one
// another to the back; so x runs to the left, y to the front and z to the head. Seen in the
// Cranium example: teeth and nose lie at low z and high y, the head rest at low y, the vertex at
// high z.
Result<Grid> project_grid(const std::string& name, const Project& project) {
    glm::dmat3 steps(1);
    for (int axis = 0; axis < 3; ++axis)
        steps[axis] *= project.spacing_mm[axis];
    return grid_from_columns(name, project.size, steps, {}, glm::dvec3(1, -1, 1));
}

Result<Project> load_project(const fs::path& path) {
    Archive archive(path);
    PALPATE_TRY(const uint64_t bytes, archive.find("main.plist"));
    if (bytes > kMostPlistBytes)
        return fail("{}: expected a main.plist of at most {} bytes, found {}", path.string(),
                    kMostPlistBytes, bytes);
    std::string plist(bytes, '\0');
    PALPATE_TRY(archive.read(std::as_writable_bytes(std::span(plist))));
    return parse_project(path.string(), plist);
}

} // namespace

Result<Decoded> decode_invesalius(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    Decoded decoded;
    PALPATE_TRY(choose_frame(request, 1, decoded.warnings));
    PALPATE_TRY(const uint64_t file_bytes, regular_file_bytes(request.path));
    PALPATE_TRY(const Project project, load_project(request.path));
    PALPATE_TRY(decoded.grid, project_grid(name, project));
    decoded.modality = project.modality;
    decoded.notes.push_back(fmt::format(
        "{}: an InVesalius project stores no position; its first voxel is put at 0 0 0", name));
    if (project.orientation != 1)
        decoded.warnings.push_back(fmt::format(
            "{}: its slices were not acquired axially; x is taken as left, y as front, z as head",
            name));

    Archive archive(request.path);
    PALPATE_TRY(const uint64_t held, archive.find(project.matrix_file));
    VoxelClaim claim;
    claim.size = project.size;
    claim.type = project.type;
    claim.source_bytes = file_bytes;
    claim.most_expansion = archive.is_packed() ? kDeflateExpansion : kRawExpansion;
    const std::optional<uint64_t> claimed = claimed_bytes(claim);
    if (claimed && held < *claimed)
        return fail("{}: main.plist claims {} bytes of voxels, but {} holds {}", name, *claimed,
                    project.matrix_file, held);
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(name, claim));
    if (held > voxels.size())
        decoded.warnings.push_back(fmt::format(
            "{}: {} holds {} bytes where main.plist claims {}; the last {} are left out", name,
            project.matrix_file, held, voxels.size(), held - voxels.size()));
    PALPATE_TRY(archive.read(voxels));
    return decoded;
}

} // namespace palpate::io
