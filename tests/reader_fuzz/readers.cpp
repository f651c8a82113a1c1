// The readers, and small valid files of each.

#include <gtest/gtest.h>

#include "engine/base/file.h"
#include "engine/decode/tiff_stack.h"
#include "engine/edit/stroke.h"
#include "engine/io/brick_file.h"
#include "engine/io/mesh_io.h"
#include "engine/io/volume_io.h"
#include "engine/mesh/topology.h"
#include "engine/scene/scene_file.h"
#include "engine/volume/builder.h"
#include "tests/reader_fuzz/harness.h"
#include "tests/support/meshes.h"
#include "tests/support/vtp_files.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/unit/io/dicom_codec.h"
#include "tests/unit/io/sample_files.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"
#include "tests/unit/io_formats/tiff_bytes.h"

namespace palpate::fuzz {

namespace {

namespace fs = std::filesystem;

template <class T>
std::optional<Error> error_of(const Result<T>& result) {
    return result ? std::optional<Error>() : result.error();
}

// Decodes in this process, so that a crash is the test's; every 16th through the child, too.
std::optional<Error> read_volume(const fs::path& path) {
    static uint64_t calls = 0;
    const auto here = io::decode_here(path, {}, kMostBytes);
    if (++calls % 16 == 0) {
        const Result<LoadedVolume> loaded = load_volume(path, {.max_memory_bytes = kMostBytes});
        // The parent refuses more than the decoder: other checks of geometry, colours.
        EXPECT_TRUE(here || !loaded) << path << " is read by the child alone";
        const std::string message = loaded ? "" : loaded.error().message;
        EXPECT_EQ(loaded ? "" : fault_of(message, path), "") << message;
    }
    return error_of(here);
}

// A header that names three files, "v.nhdr.0" and so on, with a third of twelve shorts each.
std::optional<Error> read_listed(const fs::path& path) {
    const std::string shorts = io::twelve_shorts();
    for (size_t i = 0; i < 3; ++i)
        if (const fs::path part = path.string() + "." + std::to_string(i); !fs::exists(part))
            std::ofstream(part, std::ios::binary) << shorts.substr(8 * i, 8);
    return read_volume(path);
}

// The metadata of a TIFF of six pages, without its pixels.
std::optional<Error> read_tiff_metadata(const fs::path& path) {
    std::vector<std::string> warnings;
    const auto stack = io::read_tiff_stack(path, 6, warnings);
    if (stack && *stack) {
        for (const uint32_t page : (*stack)->pages)
            EXPECT_LT(page, 6u);
    }
    for (const std::string& warning : warnings)
        EXPECT_EQ(fault_of(warning, path), "") << warning;
    return error_of(stack);
}

std::optional<Error> read_sandboxed(const fs::path& path) {
    return error_of(load_volume(path, {.max_memory_bytes = kMostBytes}));
}

std::optional<Error> read_bricks(const fs::path& path) {
    const Result<BrickFile> file = open_brick_file(path, kMostBytes);
    if (!file)
        return file.error();
    try {
        std::vector<float> row(file->volume.size().x);
        for (uint32_t z = 0; z < file->volume.size().z; ++z)
            for (uint32_t y = 0; y < file->volume.size().y; ++y)
                read_row(file->volume, {0, y, z}, file->volume.size().x, row.data());
    } catch (const SourceError& error) {
        return Error{error.what()};
    }
    return {};
}

std::optional<Error> read_mesh(const fs::path& path) {
    const Result<LoadedMesh> loaded = load_mesh(path, {.max_memory_bytes = kMostBytes});
    if (!loaded)
        return loaded.error();
    const Mesh& mesh = loaded->mesh;
    for (const glm::uvec3 t : mesh.triangles)
        for (int i = 0; i < 3; ++i)
            EXPECT_LT(t[i], mesh.positions.size());
    EXPECT_TRUE(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
    EXPECT_TRUE(mesh.labels.empty() || mesh.labels.size() == mesh.triangles.size());
    EXPECT_TRUE(mesh.outer_labels.empty() || mesh.outer_labels.size() == mesh.triangles.size());
    return {};
}

std::optional<Error> read_strokes(const fs::path& path) {
    const Result<std::string> text = load_text(path);
    return text ? error_of(parse_strokes(*text, path.string())) : text.error();
}

// A PNG whose chunks have right checksums, as far as their lengths lead.
std::string sign_png(std::string bytes) {
    for (size_t at = 8; at + 12 <= bytes.size();) {
        uint32_t length = 0;
        for (size_t i = 0; i < 4; ++i)
            length = length << 8 | static_cast<unsigned char>(bytes[at + i]);
        if (length > bytes.size() - at - 12)
            break;
        const std::string chunk =
            test::png_chunk(bytes.substr(at + 4, 4), bytes.substr(at + 8, length));
        bytes.replace(at, chunk.size(), chunk);
        at += chunk.size();
    }
    return bytes;
}

// The bytes that save(path) writes.
template <class Save>
std::string saved(const std::string& name, const Save& save) {
    const io::TemporaryFolder folder;
    const Result<void> done = save(folder.path() / name);
    EXPECT_TRUE(done) << done.error().message;
    return io::read_bytes(folder.path() / name);
}

std::string mesh_bytes(const std::string& name, bool ascii) {
    Mesh mesh = meshes::ball(10.0, 1);
    mesh.normals = vertex_normals(mesh);
    for (size_t n = 0; n < mesh.triangles.size(); ++n)
        mesh.labels.push_back(static_cast<uint16_t>(n % 3));
    return saved(name,
                 [&](const fs::path& path) { return save_mesh(path, mesh, {.ascii = ascii}); });
}

// A CT of 16 x 12 samples with some structure, in a transfer syntax.
std::string dicom_image(const std::string& syntax, uint16_t allocated, uint16_t stored) {
    test::DicomData data = test::samples(16, 12, allocated, stored, false);
    std::string pixels;
    for (int i = 0; i < 16 * 12; ++i)
        pixels += test::little(static_cast<uint64_t>(i * i % 251), allocated / 8);
    test::place(data, "0\\0\\0", "1\\0\\0\\0\\1\\0", "1\\1");
    data.put(0x7fe0, 0x10, "OW", pixels);
    const std::string plain = data.file(test::kCtClass, "1.2.3");
    return syntax == test::kExplicitLittle ? plain : test::encoded(plain, syntax);
}

// Two frames of one segment each.
std::string segmentation(const char* kind, uint16_t allocated) {
    test::DicomData data = test::samples(16, 12, allocated, allocated, false);
    data.put(0x28, 8, "IS", "2").put(0x62, 1, "CS", kind).put_words(0x62, 0xe, {200});
    std::vector<test::DicomData> segments(1), frames(2);
    segments[0].put_words(0x62, 4, {1}).put(0x62, 5, "LO", "liver");
    segments[0].put_words(0x62, 0xd, {35580, 53662, 50857});
    for (int i = 0; i < 2; ++i) {
        test::DicomData position, axes, measures, segment;
        position.put(0x20, 0x32, "DS", std::to_string(4 * i) + "\\0\\" + std::to_string(6 * i));
        axes.put(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0");
        measures.put(0x28, 0x30, "DS", "1\\1").put(0x18, 0x88, "DS", "3");
        segment.put_words(0x62, 0xb, {1});
        frames[static_cast<size_t>(i)]
            .put_items(0x20, 0x9113, {position})
            .put_items(0x20, 0x9116, {axes})
            .put_items(0x28, 0x9110, {measures})
            .put_items(0x62, 0xa, {segment});
    }
    data.put_items(0x62, 2, segments).put_items(0x5200, 0x9230, frames);
    std::string pixels;
    for (int i = 0; i < 2 * 16 * 12 * allocated / 8; ++i)
        pixels.push_back(static_cast<char>(i * 37));
    return data.put(0x7fe0, 0x10, "OW", pixels)
        .file(allocated == 8 && kind == std::string("LABELMAP") ? test::kLabelMapClass
                                                                : test::kSegClass,
              "1.2.4");
}

// Six pages with what ImageJ or OME states of them.
std::vector<std::string> tiff_stacks() {
    std::vector<std::string> files;
    for (const bool big : {false, true}) {
        io::TiffBytes tiff{.big_endian = big, .big_tiff = big};
        tiff.x_pixels = tiff.y_pixels = 3;
        tiff.unit = 2;
        const auto pages = io::pages_of({3, 2, 3, 1}, 2, 1, "czt");
        tiff.description =
            "ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\nhyperstack=true\nunit=\\u00B5m\n"
            "spacing=20.5\ncf=0\nc0=-32768.0\nc1=1.0\nzunit=nm\n";
        files.push_back(tiff.file(3, 2, pages));
        tiff.description =
            "<?xml version=\"1.0\"?><OME xmlns=\"o\"><Image><Pixels DimensionOrder=\"XYCZT\" "
            "SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\" PhysicalSizeX=\"2\" PhysicalSizeY=\"2\" "
            "PhysicalSizeZ=\"3\" PhysicalSizeZUnit=\"nm\"><Channel/><TiffData IFD=\"0\" "
            "PlaneCount=\"4\"/><TiffData IFD=\"4\" FirstZ=\"2\"/><TiffData IFD=\"5\" FirstC=\"1\" "
            "FirstZ=\"2\"/></Pixels></Image></OME>";
        files.push_back(tiff.file(3, 2, pages));
    }
    return files;
}

// A header of 2 x 3 x 2 x 1 numbers whose first axis is a list.
std::string list_first(const std::string& more) {
    return "NRRD0005\ntype: short\ndimension: 4\nsizes: 2 3 2 1\nspace: LPS\n"
           "kinds: list domain domain domain\nspace directions: none (1,0,0) (0,1,0) (0,0,2)\n"
           "units: \"\" \"um\" \"um\" \"um\"\nendian: little\n" +
           more;
}

} // namespace

std::vector<Reader> volume_readers() {
    using namespace io;
    const std::string segments =
        "Segment0_ID:=a\nSegment0_Name:=liver\nSegment0_Layer:=0\nSegment0_LabelValue:=3\n"
        "Segment0_Color:=1 0.5 0\nSegment1_ID:=b\nSegment1_Layer:=1\nSegment1_LabelValue:=4\n";
    std::string extended =
        NiftiBytes(1)
            .sform(1, std::vector<double>(12, 0))
            .qform(1, {0, 0, 1, 1, 2, 3})
            .vox_offset(352 + 32)
            .with(bytes_of(std::vector<int32_t>{32, 6}) + std::string(24, 'c') + twelve_shorts());
    extended[348] = 1; // extensions follow
    const std::string shorts = twelve_shorts();
    const std::string gzip = "encoding: gzip\nendian: little\n", text = "encoding: ascii\n";
    return {
        {"Nifti", "v.nii", {NiftiBytes(1).with(shorts), NiftiBytes(2).with(shorts)}, read_volume},
        {"PackedNifti", "v.nii.gz", {deflated(NiftiBytes(1).with(shorts))}, read_volume},
        {"Mgh", "v.mgh", {mgh(), mgh({.type = 3, .has_geometry = false})}, read_volume},
        {"Mgz", "v.mgz", {deflated(mgh())}, read_volume},
        {"Nrrd",
         "v.nrrd",
         {nrrd_header() + "\n" + shorts, nrrd_header(gzip) + "\n" + deflated(shorts),
          nrrd_header(text) + "\n1 2 3 4 5 6 7 8 9 10 11 12"},
         read_volume},
        {"MetaImage",
         "v.mha",
         {meta_image_header("") + shorts,
          meta_image_header("CompressedData = True\n") + deflated(shorts, 15)},
         read_volume},
        {"NiftiExtension", "v.nii", {extended, deflated(extended)}, read_volume},
        {"NrrdFrames",
         "v.nrrd",
         {list_first("encoding: raw\n") + "\n" + shorts,
          list_first("encoding: gzip\n") + "\n" + deflated(shorts),
          list_first("encoding: ascii\n") + "\n1 2 3 4 5 6 7 8 9 10 11 12"},
         read_volume},
        {"NrrdLayers",
         "v.seg.nrrd",
         {list_first("encoding: raw\n" + segments) + "\n" + shorts,
          list_first("encoding: gzip\n" + segments) + "\n" + deflated(shorts)},
         read_volume},
        {"NrrdList",
         "v.nhdr",
         {nrrd_header("encoding: raw\nendian: little\ndata file: LIST 3\n") +
              "v.nhdr.0\nv.nhdr.1\nv.nhdr.2\n",
          nrrd_header("encoding: raw\nendian: little\ndata file: v.nhdr.%d 0 2 1\n")},
         read_listed},
        {"MetaList",
         "v.mhd",
         {"NDims = 3\nDimSize = 2 2 3\nElementType = MET_SHORT\nElementSpacing = 1 1 1\n"
          "DistanceUnits = um\nElementDataFile = LIST 2D\nv.mhd.0\nv.mhd.1\nv.mhd.2\n",
          "NDims = 3\nDimSize = 2 2 3\nElementType = MET_SHORT\nElementSpacing = 1 1 1\n"
          "ElementDataFile = v.mhd.%01d 0 2 1\n"},
         read_listed},
        {"TiffMetadata", "a.tif", tiff_stacks(), read_tiff_metadata},
        {"Vtk", "v.vtk", {test::legacy_vtk(false), test::legacy_vtk(true)}, read_volume},
        {"Vti", "v.vti", {test::vti()}, read_volume},
        {"Invesalius", "p.inv3", {project(), deflated(project())}, read_volume},
        {"BrickFile",
         "v.pbv",
         {saved("v.pbv",
                [](const fs::path& path) {
                    return save_volume(path,
                                       make_volume(make_grid({9, 8, 7}, {1, 1, 2}), ScalarType::i16,
                                                   [](glm::uvec3 i) { return i.x * i.y + i.z; }));
                })},
         read_bricks},
    };
}

std::vector<Reader> sandboxed_readers() {
    const std::string png = test::png({{1, 2, 3}, {400, 500, 600}});
    const auto dicom = [](const std::string& name, const std::string& syntax, uint16_t allocated,
                          uint16_t stored) {
        return Reader{name, "a.dcm", {dicom_image(syntax, allocated, stored)}, read_sandboxed};
    };
    std::vector<Reader> readers{
        {"Png", "slice.png", {png}, read_sandboxed},
        {"SignedPng", "slice.png", {png}, read_sandboxed, sign_png},
        {"Jpeg",
         "slice.jpg",
         {test::jpeg({{10, 250}, {129, 1}}), test::jpeg({{10, 250}, {129, 1}}, 1)},
         read_sandboxed},
        {"Tiff",
         "slice.tif",
         {test::tiff({{1, 2, 3}, {400, 500, 600}}), test::tiff({{1, 2}, {400, 500}}, true)},
         read_sandboxed},
        {"TiffStack", "a.tif", tiff_stacks(), read_sandboxed},
        {"Bmp",
         "slice.bmp",
         {test::bmp({{1, 2, 3}, {40, 50, 60}}), test::bmp({{1, 2, 3}, {40, 50, 60}}, true)},
         read_sandboxed},
        dicom("Dicom", test::kExplicitLittle, 16, 12),
        dicom("DicomImplicit", "1.2.840.10008.1.2", 16, 12),
        dicom("DicomBigEndian", "1.2.840.10008.1.2.2", 16, 12),
        dicom("DicomDeflated", "1.2.840.10008.1.2.1.99", 16, 12),
        dicom("DicomRle", test::kRle, 16, 12),
        dicom("DicomJpeg8", "1.2.840.10008.1.2.4.50", 8, 8),
        dicom("DicomJpegLossless", "1.2.840.10008.1.2.4.70", 16, 16),
        dicom("DicomJpegLs", test::kJpegLsLossless, 16, 12),
        dicom("DicomJpeg2000", test::kJpeg2000Lossless, 16, 12),
        {"DicomSeg",
         "seg.dcm",
         {segmentation("BINARY", 1), segmentation("FRACTIONAL", 8), segmentation("LABELMAP", 8)},
         read_sandboxed},
    };
    for (Reader& reader : readers)
        reader.in_child = true;
    return readers;
}

std::vector<Reader> mesh_readers() {
    return {
        {"Ply", "m.ply", {mesh_bytes("m.ply", false), mesh_bytes("m.ply", true)}, read_mesh},
        {"Obj", "m.obj", {mesh_bytes("m.obj", false)}, read_mesh},
        {"Vtp",
         "m.vtp",
         {mesh_bytes("m.vtp", false), vtp::square({}), vtp::square({vtp::Form::base64, true}),
          vtp::square({vtp::Form::appended_base64}), vtp::square({vtp::Form::appended_raw, true}),
          vtp::square({}, "RAS"), vtp::square({vtp::Form::appended_raw, true}, "RAS")},
         read_mesh},
        {"Stl", "m.stl", {mesh_bytes("m.stl", false), mesh_bytes("m.stl", true)}, read_mesh},
        {"X3d",
         "m.x3d",
         {"<X3D><Scene><Viewpoint position='0 0 2'/><Transform DEF='T' rotation='0 1 0 0.5'"
          " scale='1 2 1'><Shape><Appearance><Material diffuseColor='1 0 0'/></Appearance>"
          "<IndexedFaceSet coordIndex='0 1 2 3 -1 0 2 3'><Coordinate point='0 0 0 1 0 0 1 1 0, 0 1"
          " 0'/></IndexedFaceSet></Shape></Transform><Transform USE='T'/><Shape><Cone height='3'/>"
          "</Shape><ClipPlane plane='0 1 0 0.5'/></Scene></X3D>"},
         read_mesh},
    };
}

std::vector<Reader> text_readers() {
    const std::string scene =
        "{\n\"volume\": \"synthetic:ball\",\n\"size_px\": [64, 48],\n\"ray_cast\": "
        "{\"mode\": \"iso\", \"isos\": [{\"value\": 300}]},\n"
        "\"slices\": [{\"normal\": [1, 0, 0]}],\n\"slice_transfer\": \"ct-bone\",\n\"surfaces\": "
        "[{\"iso\": 300}]\n}\n";
    const std::string strokes =
        "{\"stroke\": 1, \"units\": \"mm\", \"shape\": {\"kind\": \"ball\", \"radius_mm\": 3}, "
        "\"operation\": {\"kind\": \"erode\", \"label\": 2}}\n"
        "{\"t_s\": 0.5, \"p_mm\": [1, 2.5, -3]}\n{\"t_s\": 0.75, \"p_mm\": [1, 2, -3]}\n";
    return {
        {"Scene",
         "s.json",
         {scene},
         [](const fs::path& path) { return error_of(load_scene(path)); }},
        {"Strokes", "s.jsonl", {strokes}, read_strokes},
    };
}

} // namespace palpate::fuzz
