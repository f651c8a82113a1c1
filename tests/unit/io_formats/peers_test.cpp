#include <gtest/gtest.h>
#include "engine/decode/itk_compiler.h"

#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>

#include <cstdio>
#include <sstream>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/unit/io_formats/sample_files.h"

// Others read the files written here: ITK reads NRRD and MetaImage, nibabel NIfTI.
namespace palpate::io {
namespace {

Volume peer_volume() {
    Grid grid;
    grid.size = {7, 5, 3};
    // Turned about z by 3-4-5, mirrored in the third axis, spacing 0.5, 2, 3.
    grid.world_from_index = glm::dmat4(glm::dvec4(0.3, 0.4, 0, 0), glm::dvec4(-1.6, 1.2, 0, 0),
                                       glm::dvec4(0, 0, -3, 0), glm::dvec4(10, -20, 30.5, 1));
    return make_volume(grid, ScalarType::i16, [](glm::uvec3 i) {
        return static_cast<double>(i.x) + 10.0 * i.y + 100.0 * i.z - 50.0;
    });
}

template <class ImageIO>
void expect_itk_reads(const std::string& path) {
    const Volume volume = peer_volume();
    ASSERT_TRUE(save_volume(path, volume));
    auto io = ImageIO::New();
    io->SetFileName(path);
    io->ReadImageInformation();
    ASSERT_EQ(io->GetNumberOfDimensions(), 3u);
    EXPECT_EQ(io->GetComponentType(), itk::IOComponentEnum::SHORT);
    glm::dmat4 read(1);
    for (unsigned axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(io->GetDimensions(axis), volume.size()[static_cast<int>(axis)]);
        const std::vector<double> direction = io->GetDirection(axis);
        for (unsigned j = 0; j < 3; ++j)
            read[static_cast<int>(axis)][static_cast<int>(j)] = direction[j] * io->GetSpacing(axis);
        read[3][static_cast<int>(axis)] = io->GetOrigin(axis);
    }
    // Direction and spacing are each rounded, and multiplied again: a few ulp of at most 3 mm.
    for (int column = 0; column < 4; ++column)
        EXPECT_LE(glm::length(read[column] - volume.grid().world_from_index[column]), 4e-15);
    std::vector<int16_t> values(sample_count(volume.grid()));
    io->SetIORegion([&] {
        itk::ImageIORegion region(3);
        for (unsigned axis = 0; axis < 3; ++axis)
            region.SetSize(axis, io->GetDimensions(axis));
        return region;
    }());
    io->Read(values.data());
    for (size_t i = 0; i < values.size(); ++i)
        ASSERT_EQ(values[i], volume.value({i % 7, i / 7 % 5, i / 35}));
}

TEST(Peers, ItkReadsMetaImageAndNrrd) {
    const TemporaryFolder folder;
    expect_itk_reads<itk::MetaImageIO>((folder.path() / "v.mha").string());
    expect_itk_reads<itk::MetaImageIO>((folder.path() / "v.mhd").string());
    expect_itk_reads<itk::NrrdImageIO>((folder.path() / "v.nrrd").string());
}

TEST(Peers, NibabelReadsNifti) {
    const TemporaryFolder folder;
    const Volume volume = peer_volume();
    // The second is too far away for 32-bit floats and becomes NIfTI-2.
    Grid far = volume.grid();
    far.world_from_index[3] = glm::dvec4(1234567.1, -20, 30.5, 1);
    for (const Volume& written : {volume, with_grid(volume, far)}) {
        const std::string path = (folder.path() / "v.nii.gz").string();
        ASSERT_TRUE(save_volume(path, written));
        const std::string script =
            "import nibabel, numpy\n"
            "i = nibabel.load('" +
            path +
            "')\n"
            "d = numpy.asarray(i.dataobj)\n"
            "assert d.shape == (7, 5, 3) and d.dtype == numpy.int16, d.dtype\n"
            "x, y, z = numpy.indices(d.shape)\n"
            "assert (d == x + 10 * y + 100 * z - 50).all()\n"
            "assert i.header.get_xyzt_units()[0] == 'mm'\n"
            "assert numpy.allclose(i.get_sform(), i.get_qform(), rtol=1e-6, atol=1e-6)\n"
            "print(*(numpy.diag([-1, -1, 1, 1]) @ i.get_sform()).ravel())\n";
        FILE* const python = ::popen(("/usr/bin/python3 -c \"" + script + "\"").c_str(), "r");
        std::string output(1000, '\0');
        output.resize(std::fread(output.data(), 1, output.size(), python));
        ASSERT_EQ(::pclose(python), 0);
        std::istringstream numbers(output);
        const glm::dmat4& expected = written.grid().world_from_index;
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 4; ++column) {
                double value = NAN;
                numbers >> value;
                // NIfTI-1 stores floats: 2^-24 of the value.
                EXPECT_NEAR(value, expected[column][row], 6e-8 * std::abs(expected[column][row]));
            }
    }
}

} // namespace
} // namespace palpate::io
