#include "engine/decode/picture.h"

#include "engine/decode/itk_compiler.h"

#include <itkBMPImageIO.h>
#include <itkPNGImageIO.h>
#include <itkTIFFImageIO.h>

#include <algorithm>

#include "engine/decode/jpeg_read.h"
#include "engine/decode/picture_check.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

using Io = itk::ImageIOBase;

struct Kind {
    std::string_view extension;
    Result<void> (*check)(const fs::path& path); // whether it is whole
    Io::Pointer (*make)();                       // null for JPEG, which is read without ITK
};

template <class T>
Io::Pointer make_io() {
    return T::New().GetPointer();
}

constexpr Kind kKinds[] = {
    {".png", check_png, make_io<itk::PNGImageIO>},
    {".tif", check_tiff, make_io<itk::TIFFImageIO>},
    {".tiff", check_tiff, make_io<itk::TIFFImageIO>},
    {".jpg", check_jpeg, nullptr},
    {".jpeg", check_jpeg, nullptr},
    {".bmp", check_bmp, make_io<itk::BMPImageIO>},
};

std::optional<ComponentType> component_type(Io::IOComponentType type) {
    using enum itk::IOComponentEnum;
    constexpr TypeKey<Io::IOComponentType> types[] = {
        {UCHAR, ComponentType::u8},  {CHAR, ComponentType::i8},   {USHORT, ComponentType::u16},
        {SHORT, ComponentType::i16}, {UINT, ComponentType::u32},  {INT, ComponentType::i32},
        {FLOAT, ComponentType::f32}, {DOUBLE, ComponentType::f64}};
    return find_type(types, type);
}

const Kind* kind_of(const fs::path& path) {
    const std::string extension = lower_case(path.extension().string());
    const auto* kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                    [&](const Kind& k) { return k.extension == extension; });
    return kind == std::end(kKinds) ? nullptr : kind;
}

// An opened picture, its header read.
Result<Io::Pointer> open(const fs::path& path, const Kind& kind) {
    Io::Pointer io = kind.make();
    if (!io->CanReadFile(path.c_str()))
        return fail("{}: expected a {} file that ITK reads, found one that it does not take",
                    path.string(), kind.extension.substr(1));
    io->SetFileName(path.string());
    io->ReadImageInformation();
    return io;
}

// The words of ITK, without the address of the object that says them.
std::string reason(const itk::ExceptionObject& error) {
    std::string text = error.GetDescription();
    std::replace(text.begin(), text.end(), '\n', ' ');
    if (const size_t at = text.find("): "); text.starts_with("ITK ERROR: ") && at != text.npos)
        text.erase(0, at + 3);
    return text;
}

} // namespace

bool is_picture(std::string_view extension) {
    return std::any_of(std::begin(kKinds), std::end(kKinds),
                       [&](const Kind& kind) { return kind.extension == extension; });
}

Result<PictureHeader> read_picture_header(const fs::path& path) try {
    const Kind* kind = kind_of(path);
    if (!kind)
        return fail("{}: is no PNG, TIFF, JPEG or BMP file by its name", path.string());
    PALPATE_TRY(regular_file_bytes(path));
    PALPATE_TRY(kind->check(path));
    if (!kind->make)
        return read_jpeg_header(path);
    PALPATE_TRY(const Io::Pointer io, open(path, *kind));
    const std::optional<ComponentType> type = component_type(io->GetComponentType());
    if (!type)
        return fail("{}: its samples are of a type that is not read", path.string());
    PictureHeader header;
    for (unsigned axis = 0; axis < 3; ++axis)
        header.size[axis] =
            axis < io->GetNumberOfDimensions() ? static_cast<uint32_t>(io->GetDimensions(axis)) : 1;
    header.type = *type;
    header.components = io->GetNumberOfComponents();
    return header;
} catch (const itk::ExceptionObject& error) {
    return fail("{}: its header cannot be read: {}", path.string(), reason(error));
}

Result<void> read_picture(const fs::path& path, std::span<std::byte> voxels) try {
    const Kind* kind = kind_of(path);
    if (!kind->make)
        return read_jpeg(path, voxels);
    PALPATE_TRY(const Io::Pointer io, open(path, *kind));
    if (static_cast<uint64_t>(io->GetImageSizeInBytes()) != voxels.size())
        return fail("{}: its size changed while it was read", path.string());
    itk::ImageIORegion region(io->GetNumberOfDimensions());
    for (unsigned axis = 0; axis < io->GetNumberOfDimensions(); ++axis)
        region.SetSize(axis, io->GetDimensions(axis));
    io->SetIORegion(region);
    io->Read(voxels.data());
    return {};
} catch (const itk::ExceptionObject& error) {
    return fail("{}: its pixels cannot be read: {}", path.string(), reason(error));
}

} // namespace palpate::io
