// DICOM files decoded in this process, in every encoding: of several frames, every place in which
// their geometry and their order may stand; and of one, floating-point pixels, padding and
// ultrasound regions.

#include <gdcmTrace.h>

#include <cstring>

#include "tests/reader_fuzz/harness.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/unit/io/frame_truth.h"
#include "tests/unit/io_formats/decode_here.h"

namespace palpate::fuzz {

namespace {

using test::DicomData;
using test::Encoding;

constexpr uint16_t kColumns = 6, kRows = 4, kSlices = 3, kTimes = 2, kFrames = kSlices * kTimes;
constexpr const char* kAxes = "1\\0\\0\\0\\1\\0";

DicomData frames() {
    DicomData data = test::samples(kColumns, kRows, 16, 16, false);
    data.put(0x28, 8, "IS", std::to_string(kFrames)).put(0x28, 0x30, "DS", "1\\1");
    std::vector<int> values;
    for (int i = 0; i < kColumns * kRows * kFrames; ++i)
        values.push_back(i * i % 251);
    return data.put(0x7fe0, 0x10, "OW", test::words_16(values));
}

// A gated reconstruction, slices against the normal.
DicomData nuclear() {
    DicomData data = frames(), detector;
    detector.put(0x20, 0x32, "DS", "-7\\-6\\10").put(0x20, 0x37, "DS", kAxes);
    data.put_items(0x54, 0x22, {detector}).put(0x18, 0x88, "DS", "-4.5");
    data.put_words(0x28, 9, {0x54, 0x60, 0x54, 0x70, 0x54, 0x80}, "AT");
    data.put_words(0x54, 0x60, {1, 1, 1, 1, 1, 1}).put_words(0x54, 0x70, {1, 1, 1, 2, 2, 2});
    return data.put_words(0x54, 0x80, {1, 2, 3, 1, 2, 3});
}

DicomData one_position() {
    DicomData data = frames();
    test::place(data, "1\\2\\3", kAxes, "1\\1");
    return data.put(0x18, 0x88, "DS", "1.5").put(0x18, 0x50, "DS", "1.5");
}

DicomData offsets() {
    DicomData data = one_position().erase(0x18, 0x88);
    data.put_words(0x28, 9, {0x18, 0x2005}, "AT");
    return data.put(0x18, 0x2005, "DS", "0\\2\\4\\6\\8\\10");
}

// An ultrasound volume, or another enhanced image, whose frames differ in echo time and time.
DicomData grouped(bool volume) {
    DicomData data = frames(), axes, measures, shared;
    if (volume)
        axes.put_doubles(0x20, 0x9302, {1, 0, 0, 0, 1, 0});
    else
        axes.put(0x20, 0x37, "DS", kAxes);
    measures.put(0x28, 0x30, "DS", "0.5\\0.5").put(0x18, 0x50, "DS", "1");
    shared.put_items(0x20, volume ? 0x930f : 0x9116, {axes}).put_items(0x28, 0x9110, {measures});
    std::vector<DicomData> per_frame;
    for (uint32_t i = 0; i < kFrames; ++i) {
        const uint32_t slice = i % kSlices, time = i / kSlices;
        DicomData position, content, echo, group;
        if (volume)
            position.put_doubles(0x20, 0x9301, {0, 0, 2.0 * slice});
        else
            position.put(0x20, 0x32, "DS", "0\\0\\" + std::to_string(2 * slice));
        content.put_longs(0x20, 0x9128, {time + 1}).put_longs(0x20, 0x9157, {1, slice, time});
        content.put(0x18, 0x9074, "DT", "2024010110203" + std::to_string(time) + ".5+0100");
        echo.put_doubles(0x18, 0x9082, {3.0 + time});
        group.put_items(0x20, volume ? 0x930e : 0x9113, {position})
            .put_items(0x20, 0x9111, {content})
            .put_items(0x18, 0x9114, {echo});
        per_frame.push_back(group);
    }
    return data.put_items(0x5200, 0x9229, {shared}).put_items(0x5200, 0x9230, per_frame);
}

// Floating-point pixels, the first eight of which are padding.
template <class T>
DicomData floating() {
    const bool doubles = sizeof(T) == 8;
    DicomData data = test::samples(kColumns, kRows, doubles ? 64 : 32, 16, false);
    test::place(data, "0\\0\\0", kAxes, "1\\1");
    const auto bytes = [](T value) {
        std::string text(sizeof(T), '\0');
        std::memcpy(text.data(), &value, sizeof(T));
        return text;
    };
    std::string pixels;
    for (int i = 0; i < kColumns * kRows; ++i)
        pixels += bytes(static_cast<T>(0.25 * i));
    const char* const vr = doubles ? "FD" : "FL";
    data.put(0x28, doubles ? 0x123 : 0x122, vr, bytes(T(0)));
    data.put(0x28, doubles ? 0x125 : 0x124, vr, bytes(T(1.75)));
    return data.put(0x7fe0, doubles ? 9 : 8, doubles ? "OD" : "OF", pixels);
}

// Whole numbers with a range of padding, and their spacing in ultrasound regions.
DicomData padded() {
    DicomData data = test::samples(kColumns, kRows, 16, 12, true), region;
    test::place(data, "0\\0\\0", kAxes, "1\\1");
    data.erase(0x28, 0x30).put(0x28, 4, "CS", "MONOCHROME1");
    data.put_words(0x28, 0x120, {0xf830}, "SS").put_words(0x28, 0x121, {8}, "SS");
    region.put_words(0x18, 0x6024, {3}).put_words(0x18, 0x6026, {3});
    region.put_doubles(0x18, 0x602c, {0.05}).put_doubles(0x18, 0x602e, {0.04});
    data.put_items(0x18, 0x6011, {region, region});
    std::vector<int> values;
    for (int i = 0; i < kColumns * kRows; ++i)
        values.push_back(i);
    return data.put(0x7fe0, 0x10, "OW", test::words_16(values));
}

std::optional<Error> read_here(const std::filesystem::path& path) {
    const auto decoded = io::decode_here(path, {}, kMostBytes);
    return decoded ? std::optional<Error>() : decoded.error();
}

std::vector<std::string> in_every_encoding(const DicomData& data, const char* class_uid) {
    std::vector<std::string> files;
    for (const bool implicit : {false, true})
        for (const bool delimited : {false, true})
            files.push_back(data.file(class_uid, "1.2.3", {}, Encoding{implicit, delimited}));
    return files;
}

} // namespace

std::vector<Reader> dicom_readers() {
    gdcm::Trace::WarningOff(); // on standard error, of each damaged file
    gdcm::Trace::ErrorOff();
    return {
        {"DicomNuclear", "a.dcm", in_every_encoding(nuclear(), "1.2.840.10008.5.1.4.1.1.20"),
         read_here},
        {"DicomOnePosition", "a.dcm", in_every_encoding(one_position(), test::kCtClass), read_here},
        {"DicomOffsets", "a.dcm", in_every_encoding(offsets(), test::kCtClass), read_here},
        {"DicomDeflatedGroups",
         "a.dcm",
         {grouped(false).file("1.2.840.10008.5.1.4.1.1.4.1", "1.2.3", {}, Encoding{false, true})},
         read_here,
         test::deflated_file},
        {"DicomEnhanced", "a.dcm", in_every_encoding(grouped(false), "1.2.840.10008.5.1.4.1.1.4.1"),
         read_here},
        {"DicomVolume", "a.dcm", in_every_encoding(grouped(true), "1.2.840.10008.5.1.4.1.1.6.2"),
         read_here},
        {"DicomFloats", "a.dcm", in_every_encoding(floating<float>(), test::kCtClass), read_here},
        {"DicomDoubles", "a.dcm", in_every_encoding(floating<double>(), test::kCtClass), read_here},
        {"DicomPadding", "a.dcm", in_every_encoding(padded(), test::kCtClass), read_here},
    };
}

} // namespace palpate::fuzz
