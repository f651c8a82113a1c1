#pragma once

#include <gdcmDataSet.h>
#include <gdcmSequenceOfItems.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

// Values of a DICOM data set's elements. What is absent or malformed is an empty value.
namespace palpate::io {

// Null where the element is absent or empty.
const gdcm::DataElement* element(const gdcm::DataSet& set, gdcm::Tag tag);
const gdcm::DataElement* element(const gdcm::DataSet&& set, gdcm::Tag tag) = delete;

// The text of an element without the padding that DICOM gives it.
std::string text(const gdcm::DataSet& set, gdcm::Tag tag);

// The parts of a text of several values ("DERIVED\PRIMARY").
std::vector<std::string> texts(const gdcm::DataSet& set, gdcm::Tag tag);

// Numbers in a decimal string ("1\0\0"); empty where any is malformed or not finite.
std::vector<double> decimals(const gdcm::DataSet& set, gdcm::Tag tag);
std::optional<double> decimal(const gdcm::DataSet& set, gdcm::Tag tag);

// An element's binary numbers: uint16_t of US and AT, uint32_t of UL, float of FL, double of FD.
// Their bytes are in native order.
template <class T>
std::vector<T> numbers(const gdcm::DataSet& set, gdcm::Tag tag) {
    const gdcm::DataElement* const found = element(set, tag);
    const gdcm::ByteValue* const bytes = found ? found->GetByteValue() : nullptr;
    std::vector<T> values(bytes ? bytes->GetLength() / sizeof(T) : 0);
    if (!values.empty())
        std::memcpy(values.data(), bytes->GetPointer(), values.size() * sizeof(T));
    return values;
}

// The first of them.
template <class T>
std::optional<T> number(const gdcm::DataSet& set, gdcm::Tag tag) {
    const std::vector<T> all = numbers<T>(set, tag);
    return all.empty() ? std::nullopt : std::optional(all.front());
}

// The first 16-bit number of an element.
template <uint16_t group, uint16_t number>
std::optional<uint16_t> word(const gdcm::DataSet& set) {
    const std::vector<uint16_t> all = numbers<uint16_t>(set, gdcm::Tag(group, number));
    return all.empty() ? std::nullopt : std::optional(all.front());
}

// A data set that is an item of a sequence. It keeps the sequence alive: of a sequence in implicit
// VR whose length is stated, GDCM makes the items anew whenever they are asked for, and nobody else
// owns them. No reference can be taken out of a temporary item.
class DicomItem {
 public:
    DicomItem() = default; // there is none
    DicomItem(gdcm::SmartPointer<gdcm::SequenceOfItems> sequence, size_t index)
        : sequence_(std::move(sequence)), set_(&sequence_->GetItem(index).GetNestedDataSet()) {}
    explicit operator bool() const { return set_ != nullptr; }
    const gdcm::DataSet& operator*() const& { return *set_; }
    const gdcm::DataSet& operator*() const&& = delete;

 private:
    gdcm::SmartPointer<gdcm::SequenceOfItems> sequence_;
    const gdcm::DataSet* set_ = nullptr;
};

// The items of a sequence; none where the element is absent or no sequence.
class DicomItems {
 public:
    DicomItems(const gdcm::DataSet& set, gdcm::Tag tag);
    size_t size() const { return sequence_ ? sequence_->GetNumberOfItems() : 0; }
    // Counted from 0; an empty item beyond the last.
    DicomItem at(size_t index) const {
        return index < size() ? DicomItem(sequence_, index + 1) : DicomItem();
    }

 private:
    gdcm::SmartPointer<gdcm::SequenceOfItems> sequence_;
};

inline DicomItem first_item(const gdcm::DataSet& set, gdcm::Tag tag) {
    return DicomItems(set, tag).at(0);
}

// The tag of a private element: `number` is 0x00 .. 0xff within the block that `creator` reserved
// (PS3.5 7.8.1). Empty where no block is reserved under that name.
std::optional<gdcm::Tag> private_tag(const gdcm::DataSet& set, uint16_t group,
                                     const std::string& creator, uint8_t number);

} // namespace palpate::io
