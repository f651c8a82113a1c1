#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

// Data sets of DICOM as bytes, little-endian (PS3.5 7, A.1 and A.2).
namespace palpate::io {

// Whether representations are written. Without them a text may be longer than 65534 bytes.
enum class DicomEncoding { explicit_little, implicit_little };

// A data set to be written. Elements come out by rising tag, whatever the order in which they are
// put; putting one again replaces it.
class DicomSet {
 public:
    // Text of any representation but UT; padded to an even length (PS3.5 6.2). `tag` has the group
    // in the high half.
    DicomSet& text(uint32_t tag, const char* representation, std::string_view value);
    DicomSet& word(uint32_t tag, uint16_t value) { return words(tag, {value}); } // US
    DicomSet& words(uint32_t tag, const std::vector<uint16_t>& values);
    DicomSet& longs(uint32_t tag, const std::vector<uint32_t>& values); // UL
    DicomSet& tag_value(uint32_t tag, uint32_t value);                  // AT
    DicomSet& bytes(uint32_t tag, std::string_view value);              // OB
    // Numbers as decimal strings, each in the fewest digits that give it back, or, where they are
    // more than the 16 characters that DICOM allows, rounded to these.
    DicomSet& decimals(uint32_t tag, const std::vector<double>& values);
    DicomSet& sequence(uint32_t tag, const std::vector<DicomSet>& items);

    // With representations, values other than those of OB and sequences are at most 65534 bytes.
    std::string encoded(DicomEncoding encoding = DicomEncoding::explicit_little) const;

 private:
    struct Element {
        std::string representation, value;
        std::vector<DicomSet> items; // of a sequence
    };
    DicomSet& put(uint32_t tag, const char* representation, std::string value);
    std::map<uint32_t, Element> elements_;
};

// The number as a decimal string (DS) of at most 16 characters.
std::string decimal_string(double value);

// The head of an element of bytes or words (OB, OW), whose value follows.
std::string long_head(uint32_t tag, const char* representation, uint32_t bytes);

// Preamble and meta header (PS3.10 7.1) of a file.
std::string file_start(std::string_view class_uid, std::string_view instance_uid,
                       DicomEncoding encoding = DicomEncoding::explicit_little);

// A new UID made from 122 random bits (PS3.5 B.2).
std::string new_uid();

} // namespace palpate::io
