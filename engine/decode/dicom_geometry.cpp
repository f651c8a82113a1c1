#include "engine/decode/dicom_geometry.h"

#include "engine/decode/dicom_marks.h"

namespace palpate::io {

using gdcm::DataSet;
using gdcm::Tag;

void take_geometry(const DataSet& set, DicomFrame& frame) {
    if (const auto p = decimals(set, Tag(0x0020, 0x0032)); p.size() == 3)
        frame.position = glm::dvec3(p[0], p[1], p[2]);
    if (const auto a = decimals(set, Tag(0x0020, 0x0037)); a.size() == 6)
        frame.axes = glm::dmat2x3{{a[0], a[1], a[2]}, {a[3], a[4], a[5]}};
    for (const Tag& tag : {Tag(0x0018, 0x1164), Tag(0x0028, 0x0030)}) // the second is preferred
        if (const auto s = decimals(set, tag); s.size() == 2 && s[0] > 0 && s[1] > 0)
            frame.spacing_mm = glm::dvec2(s[1], s[0]); // stored: between rows, between columns
    for (const Tag& tag : {Tag(0x0018, 0x0050), Tag(0x0018, 0x0088)})
        if (const auto step = decimal(set, tag); step && *step > 0)
            frame.slice_step_mm = step;
    frame.rescale.slope = decimal(set, Tag(0x0028, 0x1053)).value_or(frame.rescale.slope);
    frame.rescale.intercept = decimal(set, Tag(0x0028, 0x1052)).value_or(frame.rescale.intercept);
}

void take_groups(const DicomItem& groups, DicomFrame& frame) {
    if (!groups)
        return;
    for (const Tag& tag :
         {Tag(0x0020, 0x9113), Tag(0x0020, 0x9116), Tag(0x0028, 0x9110), Tag(0x0028, 0x9145)})
        if (const DicomItem group = first_item(*groups, tag))
            take_geometry(*group, frame);
    if (const DicomItem group = first_item(*groups, Tag(0x0062, 0x000a)))
        frame.segment = word<0x0062, 0x000b>(*group).value_or(frame.segment);
    take_group_marks(*groups, frame.marks);
}

} // namespace palpate::io
