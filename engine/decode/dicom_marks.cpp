#include "engine/decode/dicom_marks.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "engine/base/error.h"

namespace palpate::io {

namespace {

using gdcm::DataSet;
using gdcm::Tag;

// GE raises b-values by 1e9 to mark some; those of scanners stay far below this.
constexpr double kMostBValue = 1e5;

const Tag kDirection(0x0018, 0x9089); // DiffusionGradientOrientation

template <class T>
std::optional<double> first_number(const DataSet& set, Tag tag) {
    const std::vector<T> all = numbers<T>(set, tag);
    if (all.empty() || !std::isfinite(static_cast<double>(all.front())))
        return {};
    return static_cast<double>(all.front());
}

void take(std::optional<double> stated, FrameKey key, FrameMarks& marks) {
    if (stated)
        marks[key] = stated;
}

std::optional<double> private_b_value(const DataSet& set) {
    if (const auto tag = private_tag(set, 0x0019, "SIEMENS MR HEADER", 0x0c))
        return decimal(set, *tag);
    if (const auto tag = private_tag(set, 0x0043, "GEMS_PARM_01", 0x39)) {
        const std::vector<double> all = decimals(set, *tag);
        return all.empty() ? std::optional<double>() : std::fmod(all.front(), kMostBValue);
    }
    if (const auto tag = private_tag(set, 0x2001, "Philips Imaging DD 001", 0x03))
        return first_number<float>(set, *tag);
    return {};
}

// The direction of diffusion in private elements: three numbers, or a number in each of three.
std::vector<double> private_gradient(const DataSet& set) {
    if (const auto tag = private_tag(set, 0x0019, "SIEMENS MR HEADER", 0x0e))
        return numbers<double>(set, *tag);
    std::vector<double> along;
    for (const uint8_t number : {0xbb, 0xbc, 0xbd})
        if (const auto tag = private_tag(set, 0x0019, "GEMS_ACQU_01", number))
            if (const auto value = decimal(set, *tag))
                along.push_back(*value);
    for (const uint8_t number : {0xb0, 0xb1, 0xb2})
        if (const auto tag = private_tag(set, 0x2005, "Philips MR Imaging DD 001", number))
            if (const auto value = first_number<float>(set, *tag))
                along.push_back(*value);
    return along;
}

void take_gradient(const std::vector<double>& along, FrameMarks& marks) {
    for (size_t i = 0; along.size() == 3 && i < 3; ++i)
        if (std::isfinite(along[i]))
            marks.values[static_cast<size_t>(FrameKey::gradient_x) + i] = along[i];
}

// The number that `count` digits at `at` are; -1 where they are none.
int digits_at(const std::string& text, size_t at, size_t count) {
    if (at + count > text.size())
        return -1;
    int value = 0;
    for (size_t i = at; i < at + count; ++i) {
        if (text[i] < '0' || text[i] > '9')
            return -1;
        value = 10 * value + (text[i] - '0');
    }
    return value;
}

// The text without the separators of ACR-NEMA ("2001.01.31", "10:20:30.5").
std::string stripped_of(std::string text, char separator) {
    std::erase(text, separator);
    return text;
}

} // namespace

std::optional<double> seconds_of(const std::string& text) {
    using namespace std::chrono;
    const year_month_day date{year(digits_at(text, 0, 4)),
                              month(static_cast<unsigned>(digits_at(text, 4, 2))),
                              day(static_cast<unsigned>(digits_at(text, 6, 2)))};
    const int hours = digits_at(text, 8, 2);
    if (!date.ok() || hours < 0)
        return {};
    const days since = sys_days(date) - sys_days(year(2000) / 1 / 1);
    double seconds = since.count() * 86400.0 + hours * 3600.0;
    seconds += std::max(0, digits_at(text, 10, 2)) * 60.0 + std::max(0, digits_at(text, 12, 2));
    double unit = 0.1;
    if (text.size() > 14 && text[14] == '.')
        for (size_t at = 15; digits_at(text, at, 1) >= 0; ++at, unit /= 10)
            seconds += digits_at(text, at, 1) * unit;
    if (const size_t zone = text.find_first_of("+-", 8); zone != std::string::npos) {
        const double offset = std::max(0, digits_at(text, zone + 1, 2)) * 3600.0 +
                              std::max(0, digits_at(text, zone + 3, 2)) * 60.0;
        seconds += text[zone] == '+' ? -offset : offset;
    }
    return seconds;
}

void take_marks(const DataSet& set, FrameMarks& marks) {
    take(decimal(set, Tag(0x0020, 0x0100)), FrameKey::temporal_position, marks);
    take(decimal(set, Tag(0x0018, 0x1060)), FrameKey::trigger_time_ms, marks);
    take(decimal(set, Tag(0x0018, 0x0081)), FrameKey::echo_time_ms, marks);
    take(private_b_value(set), FrameKey::b_value, marks);
    take(first_number<double>(set, Tag(0x0018, 0x9087)), FrameKey::b_value, marks);
    take_gradient(private_gradient(set), marks);
    take_gradient(numbers<double>(set, kDirection), marks);
    take(decimal(set, Tag(0x0020, 0x0012)), FrameKey::acquisition_number, marks);
    take(decimal(set, Tag(0x0018, 0x0086)), FrameKey::echo_number, marks);
    take(decimal(set, Tag(0x0018, 0x0082)), FrameKey::inversion_time_ms, marks);
    take(decimal(set, Tag(0x0018, 0x1314)), FrameKey::flip_angle, marks);
    take(decimal(set, Tag(0x0054, 0x1300)), FrameKey::reference_time_ms, marks);
    // The date is that of the acquisition, the series or the study; without any, the times of one
    // day are compared.
    std::string date = "20000101";
    for (const Tag& tag : {Tag(0x0008, 0x0020), Tag(0x0008, 0x0021), Tag(0x0008, 0x0022)})
        if (const std::string stated = stripped_of(text(set, tag), '.'); stated.size() == 8)
            date = stated;
    if (const std::string time = stripped_of(text(set, Tag(0x0008, 0x0032)), ':'); !time.empty())
        take(seconds_of(date + time), FrameKey::acquisition_time_s, marks);
    take(seconds_of(text(set, Tag(0x0008, 0x002a))), FrameKey::acquisition_time_s, marks);
    if (const std::string type = text(set, Tag(0x0008, 0x0008)); !type.empty())
        marks.image_type = type;
}

void take_group_marks(const DataSet& groups, FrameMarks& marks) {
    if (const DicomItem content = first_item(groups, Tag(0x0020, 0x9111))) {
        take(first_number<uint32_t>(*content, Tag(0x0020, 0x9128)), FrameKey::temporal_position,
             marks);
        take(first_number<uint16_t>(*content, Tag(0x0020, 0x9156)), FrameKey::acquisition_number,
             marks);
        take(seconds_of(text(*content, Tag(0x0018, 0x9074))), FrameKey::acquisition_time_s, marks);
        if (const auto values = numbers<uint32_t>(*content, Tag(0x0020, 0x9157)); !values.empty()) {
            marks.indices.clear();
            for (const uint32_t value : values)
                marks.indices.push_back(
                    {fmt::format("DimensionIndexValues {}", marks.indices.size() + 1), value});
        }
    }
    struct Place {
        Tag group, element;
        FrameKey key;
    };
    for (const Place& place : {
             Place{Tag(0x0020, 0x9310), Tag(0x0020, 0x930d), FrameKey::temporal_position},
             Place{Tag(0x0018, 0x9118), Tag(0x0020, 0x9153), FrameKey::trigger_time_ms},
             Place{Tag(0x0018, 0x9114), Tag(0x0018, 0x9082), FrameKey::echo_time_ms},
             Place{Tag(0x0018, 0x9117), Tag(0x0018, 0x9087), FrameKey::b_value},
         })
        if (const DicomItem group = first_item(groups, place.group))
            take(first_number<double>(*group, place.element), place.key, marks);
    if (const DicomItem diffusion = first_item(groups, Tag(0x0018, 0x9117)))
        if (const DicomItem direction = first_item(*diffusion, Tag(0x0018, 0x9076)))
            take_gradient(numbers<double>(*direction, kDirection), marks);
    if (const DicomItem type = first_item(groups, Tag(0x0018, 0x9226)))
        if (const std::string stated = text(*type, Tag(0x0008, 0x9007)); !stated.empty())
            marks.image_type = stated;
}

} // namespace palpate::io
