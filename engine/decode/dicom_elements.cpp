#include "engine/decode/dicom_elements.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>

namespace palpate::io {

using gdcm::DataSet;
using gdcm::Tag;

const gdcm::DataElement* element(const DataSet& set, Tag tag) {
    if (!set.FindDataElement(tag))
        return nullptr;
    const gdcm::DataElement& found = set.GetDataElement(tag);
    return found.IsEmpty() ? nullptr : &found;
}

std::string text(const DataSet& set, Tag tag) {
    const gdcm::DataElement* found = element(set, tag);
    const gdcm::ByteValue* bytes = found ? found->GetByteValue() : nullptr;
    if (!bytes)
        return {};
    std::string value(bytes->GetPointer(), bytes->GetLength());
    while (!value.empty() && (value.back() == ' ' || value.back() == '\0'))
        value.pop_back();
    while (!value.empty() && value.front() == ' ')
        value.erase(0, 1);
    return value;
}

std::vector<std::string> texts(const DataSet& set, Tag tag) {
    std::vector<std::string> parts;
    const std::string all = text(set, tag);
    for (size_t start = 0; start < all.size();) {
        const size_t end = std::min(all.find('\\', start), all.size());
        std::string part = all.substr(start, end - start);
        while (!part.empty() && part.back() == ' ')
            part.pop_back();
        parts.push_back(std::move(part));
        start = end + 1;
    }
    return parts;
}

std::vector<double> decimals(const DataSet& set, Tag tag) {
    std::vector<double> numbers;
    for (const std::string& one : texts(set, tag)) {
        char* stop = nullptr;
        numbers.push_back(std::strtod(one.c_str(), &stop));
        if (stop == one.c_str() || !std::isfinite(numbers.back()))
            return {};
    }
    return numbers;
}

std::optional<double> decimal(const DataSet& set, Tag tag) {
    const std::vector<double> numbers = decimals(set, tag);
    return numbers.empty() ? std::nullopt : std::optional(numbers.front());
}

DicomItems::DicomItems(const DataSet& set, Tag tag) {
    const gdcm::DataElement* const found = element(set, tag);
    if (!found)
        return;
    try { // GDCM parses what is in implicit VR only now
        sequence_ = found->GetValueAsSQ();
    } catch (const std::exception&) {
        sequence_ = nullptr;
    }
}

std::optional<Tag> private_tag(const DataSet& set, uint16_t group, const std::string& creator,
                               uint8_t number) {
    for (uint16_t block = 0x10; block <= 0xff; ++block)
        if (text(set, Tag(group, block)) == creator)
            return Tag(group, static_cast<uint16_t>(block << 8 | number));
    return {};
}

} // namespace palpate::io
