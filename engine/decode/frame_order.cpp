#include "engine/decode/frame_order.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "engine/base/printable.h"

namespace palpate::io {

namespace {

// How the values of one frame at different places go together.
enum class Holds {
    value,  // belongs to one frame at all places
    number, // counts images: at several places it is another, but never that of another frame
    time,   // rises from frame to frame at each place
};

struct Key {
    const char* name;
    const char* unit;
    Holds holds;
};
constexpr Key kKeys[kFrameKeys] = {
    {"TemporalPositionIdentifier", "", Holds::value},
    {"TriggerTime", " ms", Holds::time},
    {"EchoTime", " ms", Holds::value},
    {"DiffusionBValue", " s/mm2", Holds::value},
    {"AcquisitionNumber", "", Holds::number},
    {"AcquisitionTime", "", Holds::time},
    {"EchoNumbers", "", Holds::value},
    {"InversionTime", " ms", Holds::value},
    {"FlipAngle", " degrees", Holds::value},
    {"FrameReferenceTime", " ms", Holds::time},
    {"DiffusionGradientOrientation x", "", Holds::value},
    {"DiffusionGradientOrientation y", "", Holds::value},
    {"DiffusionGradientOrientation z", "", Holds::value},
};
constexpr size_t kMostInWords = 6;

// One attribute of all images, place after place.
struct Column {
    std::string name, unit;
    Holds holds = Holds::value;
    bool alone = false;             // whether it may order frames by itself
    std::vector<double> values;     // as many as there are images
    std::vector<std::string> texts; // where values count these, from 0
};
using Columns = std::vector<Column>;
using Ranks = std::vector<size_t>; // of each image at its place, place after place

class Order {
 public:
    Order(const std::string& name, const std::vector<std::vector<DicomFrame>>& places)
        : name_(name), each_(places.front().size()) {
        for (const auto& place : places)
            for (const DicomFrame& frame : place)
                images_.push_back(&frame);
        add_keys();
        add_type_and_indices();
    }

    struct Found {
        Ranks ranks;
        std::string words;
    };
    Result<Found> find() const {
        std::vector<std::pair<const Column*, Ranks>> telling;
        for (const Column& column : columns_)
            if (column.alone)
                if (auto ranks = ranks_by({&column}); ranks && fits(column, *ranks))
                    telling.emplace_back(&column, std::move(*ranks));
        if (telling.empty())
            return together();
        const auto& [first, ranks] = telling.front();
        std::set<const Column*> tell;
        for (const auto& [other, others] : telling) {
            if (others != ranks)
                return disagree(*first, *other, "order them differently");
            tell.insert(other);
        }
        // A time that passes from one echo to another would mix them.
        for (const Column& other : columns_)
            if (other.alone && other.holds == Holds::value && varies(other) &&
                !tell.contains(&other) && !is_constant(other, ranks))
                return disagree(*first, other, "do not go together from place to place");
        return Found{ranks, words_of(*first)};
    }

 private:
    void add_keys() {
        for (size_t k = 0; k < kFrameKeys; ++k) {
            Column column{kKeys[k].name, kKeys[k].unit, kKeys[k].holds, k < kMainFrameKeys, {}, {}};
            size_t stated = 0;
            for (const DicomFrame* image : images_) {
                stated += image->marks.values[k].has_value();
                column.values.push_back(image->marks.values[k].value_or(0));
            }
            const bool may_lack = k >= static_cast<size_t>(FrameKey::gradient_x) && stated > 0;
            if (stated == images_.size() || may_lack)
                columns_.push_back(std::move(column));
            else if (stated > 0)
                partly_.push_back(fmt::format("{} is stated by {} of {} images", column.name,
                                              stated, images_.size()));
            else if (column.alone)
                absent_ += (absent_.empty() ? "" : ", ") + column.name;
        }
    }

    void add_type_and_indices() {
        std::set<std::string> types;
        for (const DicomFrame* image : images_)
            types.insert(image->marks.image_type);
        Column type{"ImageType", "", Holds::value, false, {}, {types.begin(), types.end()}};
        for (const DicomFrame* image : images_)
            type.values.push_back(static_cast<double>(
                std::distance(types.begin(), types.find(image->marks.image_type))));
        if (types.size() > 1)
            columns_.push_back(std::move(type));
        const size_t dimensions = images_.front()->marks.indices.size();
        for (const DicomFrame* image : images_)
            if (image->marks.indices.size() != dimensions)
                return;
        for (size_t d = 0; d < dimensions; ++d) {
            Column index{images_.front()->marks.indices[d].name, "", Holds::value, false, {}, {}};
            for (const DicomFrame* image : images_)
                index.values.push_back(image->marks.indices[d].value);
            columns_.push_back(std::move(index));
        }
    }

    // Absent where two images of a place are equal in all columns.
    std::optional<Ranks> ranks_by(const std::vector<const Column*>& columns) const {
        const auto compare = [&](size_t a, size_t b) {
            for (const Column* column : columns)
                if (column->values[a] != column->values[b])
                    return column->values[a] < column->values[b] ? -1 : 1;
            return 0;
        };
        Ranks ranks(images_.size());
        std::vector<size_t> place(each_);
        for (size_t first = 0; first < images_.size(); first += each_) {
            std::iota(place.begin(), place.end(), first);
            std::sort(place.begin(), place.end(),
                      [&](size_t a, size_t b) { return compare(a, b) < 0; });
            for (size_t rank = 0; rank < each_; ++rank) {
                if (rank > 0 && compare(place[rank - 1], place[rank]) == 0)
                    return {};
                ranks[place[rank]] = rank;
            }
        }
        return ranks;
    }

    bool fits(const Column& column, const Ranks& ranks) const {
        if (column.holds == Holds::time)
            return true;
        std::map<double, size_t> rank_of;
        for (size_t i = 0; i < images_.size(); ++i)
            if (rank_of.try_emplace(column.values[i], ranks[i]).first->second != ranks[i])
                return false;
        // Values in rising order are then those of frame after frame.
        return column.holds == Holds::number ||
               std::is_sorted(rank_of.begin(), rank_of.end(),
                              [](const auto& a, const auto& b) { return a.second < b.second; });
    }

    // Whether the images of each rank state one value.
    bool is_constant(const Column& column, const Ranks& ranks) const {
        std::vector<double> values(each_);
        for (size_t i = 0; i < each_; ++i)
            values[ranks[i]] = column.values[i];
        for (size_t i = 0; i < images_.size(); ++i)
            if (column.values[i] != values[ranks[i]])
                return false;
        return true;
    }

    // Whether a column differs among the images of some place.
    bool varies(const Column& column) const {
        for (size_t i = 0; i < images_.size(); ++i)
            if (column.values[i] != column.values[i / each_ * each_])
                return true;
        return false;
    }

    // The order by all columns that differ, where none does alone.
    Result<Found> together() const {
        std::vector<const Column*> columns;
        std::string words;
        for (const Column& column : columns_)
            if (varies(column)) {
                columns.push_back(&column);
                words += (words.empty() ? "" : ", then ") + column.name;
            }
        const std::optional<Ranks> ranks = ranks_by(columns);
        if (ranks && std::all_of(columns.begin(), columns.end(), [&](const Column* column) {
                return column->holds == Holds::time || is_constant(*column, *ranks);
            }))
            return Found{*ranks, columns.size() == 1 ? words_of(*columns.front()) : words};
        if (!ranks && each_ == images_.size() && is_one_file()) {
            Ranks stored(each_);
            std::iota(stored.begin(), stored.end(), size_t{0});
            return Found{stored, "their order in the file"};
        }
        return nothing_tells();
    }

    bool is_one_file() const {
        return std::all_of(images_.begin(), images_.end(), [&](const DicomFrame* image) {
            return image->file == images_.front()->file;
        });
    }

    std::string word_of(const Column& column, size_t image) const {
        const double value = column.values[image];
        if (!column.texts.empty())
            return printable(column.texts[static_cast<size_t>(value)]);
        if (column.name != kKeys[static_cast<size_t>(FrameKey::acquisition_time_s)].name)
            return fmt::format("{:.6g}", value);
        const double day = value - std::floor(value / 86400) * 86400;
        const double minutes = std::floor(day / 60);
        return fmt::format("{:02.0f}:{:02.0f}:{:06.3f}", std::floor(minutes / 60),
                           std::fmod(minutes, 60), day - 60 * minutes);
    }

    // The values at a place, in the order of the images, or sorted.
    std::string values_of(const Column& column, size_t place, bool sorted) const {
        std::vector<size_t> images(each_);
        std::iota(images.begin(), images.end(), place * each_);
        if (sorted)
            std::sort(images.begin(), images.end(),
                      [&](size_t a, size_t b) { return column.values[a] < column.values[b]; });
        std::string text;
        for (size_t i = 0; i < std::min(each_, kMostInWords); ++i)
            text += (i == 0 ? "" : ", ") + word_of(column, images[i]);
        return text + (each_ > kMostInWords ? ", .." : "") + column.unit;
    }

    std::string words_of(const Column& column) const {
        return fmt::format("{} ({})", column.name, values_of(column, 0, true));
    }

    std::string start() const {
        std::string files;
        for (size_t i = 0; i < std::min<size_t>(each_, 3); ++i)
            files += (i == 0 ? "" : ", ") + leaf(*images_[i]);
        const glm::dvec3 at = images_.front()->position.value_or(glm::dvec3(0));
        const size_t places = images_.size() / each_;
        return fmt::format("{}: {} images lie at {} ({}{} at ({:.6g}, {:.6g}, {:.6g}) mm)", name_,
                           each_,
                           places == 1 ? "one place" : fmt::format("each of {} places", places),
                           files, each_ > 3 ? ", .." : "", at.x, at.y, at.z);
    }

    // The first place at which two columns show it.
    Result<Found> disagree(const Column& a, const Column& b, const char* how) const {
        size_t place = 0;
        const auto rising = [&](size_t at) {
            for (size_t i = at * each_; i < (at + 1) * each_; ++i)
                for (size_t j = at * each_; j < i; ++j)
                    if ((a.values[i] < a.values[j]) != (b.values[i] < b.values[j]))
                        return false;
            return true;
        };
        while ((place + 1) * each_ < images_.size() && rising(place))
            ++place;
        return fail(
            "{}, but {} ({}) and {} ({}) {}; put each frame's images into a folder of its "
            "own",
            start(), a.name, values_of(a, place, false), b.name, values_of(b, place, false), how);
    }

    Result<Found> nothing_tells() const {
        std::string found;
        const auto add = [&](const std::string& text) {
            found += (found.empty() ? "" : "; ") + text;
        };
        for (const Column& column : columns_)
            if (column.alone || varies(column)) {
                const size_t last = images_.size() / each_ - 1;
                const std::string here = values_of(column, 0, false);
                const std::string there = values_of(column, last, false);
                add(fmt::format(
                    "{} is {}{}", column.name, here,
                    here == there ? "" : " at the first place, " + there + " at the last"));
            }
        for (const std::string& partly : partly_)
            add(partly);
        if (!absent_.empty())
            add(absent_ + " are not stated");
        return fail(
            "{}, but no attribute tells which belong to one frame: {}; InstanceNumber and "
            "file names do not say it: put each frame's images into a folder of its own",
            start(), found);
    }

    std::string name_;
    size_t each_; // images at a place
    std::vector<const DicomFrame*> images_;
    Columns columns_;
    std::vector<std::string> partly_;
    std::string absent_;
};

} // namespace

Result<std::string> order_frames(const std::string& name,
                                 std::vector<std::vector<DicomFrame>>& places) {
    PALPATE_TRY(const auto found, Order(name, places).find());
    size_t first = 0;
    for (std::vector<DicomFrame>& place : places) {
        std::vector<DicomFrame> sorted(place.size());
        for (size_t i = 0; i < place.size(); ++i)
            sorted[found.ranks[first + i]] = std::move(place[i]);
        first += place.size();
        place = std::move(sorted);
    }
    return found.words;
}

} // namespace palpate::io
