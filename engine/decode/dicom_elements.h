#pragma once

#include <gdcmDataSet.h>
#include <gdcmSequenceOfItems.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

// Values of a DICOM data set's elements. What is absent or malformed is an empty value.
namespace palpate::io {

using DicomItems = gdcm::SmartPointer<gdcm::SequenceOfItems>;

// Null where the element is absent or empty.
const gdcm::DataElement* element(const gdcm::DataSet& set, gdcm::Tag tag);

// The text of an element without the padding that DICOM gives it.
std::string text(const gdcm::DataSet& set, gdcm::Tag tag);

// The parts of a text of several values ("DERIVED\PRIMARY").
std::vector<std::string> texts(const gdcm::DataSet& set, gdcm::Tag tag);

// Numbers in a decimal string ("1\0\0"); empty where any is malformed or not finite.
std::vector<double> decimals(const gdcm::DataSet& set, gdcm::Tag tag);
std::optional<double> decimal(const gdcm::DataSet& set, gdcm::Tag tag);

// An element's 16-bit numbers, and the first of them.
std::vector<uint16_t> words(const gdcm::DataSet& set, gdcm::Tag tag);
template <uint16_t group, uint16_t number>
std::optional<uint16_t> word(const gdcm::DataSet& set) {
    const std::vector<uint16_t> all = words(set, gdcm::Tag(group, number));
    return all.empty() ? std::nullopt : std::optional(all.front());
}

// Null where there is no such sequence.
DicomItems sequence(const gdcm::DataSet& set, gdcm::Tag tag);
// Item `index`, counted from 1; null where there is none.
const gdcm::DataSet* item(const DicomItems& items, size_t index);

// The tag of a private element: `number` is 0x00 .. 0xff within the block that `creator` reserved
// (PS3.5 7.8.1). Empty where no block is reserved under that name.
std::optional<gdcm::Tag> private_tag(const gdcm::DataSet& set, uint16_t group,
                                     const std::string& creator, uint8_t number);

} // namespace palpate::io
