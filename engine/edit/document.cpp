#include "engine/edit/document.h"

#include <algorithm>

namespace palpate {

const char* name_of(VolumeKind kind) {
    switch (kind) {
        case VolumeKind::grey:
            return "grey";
        case VolumeKind::labels:
            return "labels";
        case VolumeKind::other:
            break;
    }
    return "other";
}

VolumeKind read_volume_kind(const JsonValue& in) {
    using enum VolumeKind;
    return in.choice<VolumeKind>({{"grey", grey}, {"labels", labels}, {"other", other}});
}

Document::Document(Volume volume, VolumeKind kind) {
    volumes.push_back({"volume", kind, std::move(volume)});
}

Result<Document> make_document(std::vector<NamedVolume> volumes) {
    if (volumes.empty())
        return fail("a document: expected at least one volume, found none");
    for (size_t i = 0; i < volumes.size(); ++i) {
        if (Result<void> named = check_volume_name(volumes[i].name); !named)
            return fail("a document: {}", named.error().message);
        for (size_t k = 0; k < i; ++k)
            if (volumes[i].name == volumes[k].name)
                return fail("a document: expected names that differ, found '{}' twice",
                            volumes[i].name);
    }
    Document document(volumes.front().volume);
    document.volumes = std::move(volumes);
    return document;
}

const Volume* Document::find(std::string_view name) const {
    for (const NamedVolume& volume : volumes)
        if (volume.name == name)
            return &volume.volume;
    return nullptr;
}

bool Document::is_same_as(const Document& other) const {
    return notes == other.notes &&
           std::equal(volumes.begin(), volumes.end(), other.volumes.begin(), other.volumes.end(),
                      [](const NamedVolume& a, const NamedVolume& b) {
                          return a.name == b.name && a.kind == b.kind &&
                                 a.volume.is_same_as(b.volume);
                      });
}

Document with_volume(Document document, NamedVolume volume) {
    for (NamedVolume& there : document.volumes)
        if (there.name == volume.name) {
            there = std::move(volume);
            return document;
        }
    document.volumes.push_back(std::move(volume));
    return document;
}

Result<void> check_volume_name(std::string_view name) {
    const bool known = name.find_first_not_of(
                           "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                           "0123456789-_.") == name.npos;
    if (name.empty() || name.size() > 64 || name.front() == '.' || !known)
        return fail(
            "expected a volume's name of 1 to 64 letters, digits, '-', '_' and '.', not beginning "
            "with '.', found '{}'",
            name);
    return {};
}

Result<void> expect_volume(const Document& document, std::string_view name) {
    if (document.find(name))
        return {};
    std::string names;
    for (const NamedVolume& volume : document.volumes)
        names += fmt::format("{}'{}'", names.empty() ? "" : ", ", volume.name);
    return fail("expected one of the volumes {}, found '{}'", names, name);
}

} // namespace palpate
