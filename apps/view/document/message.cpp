#include "apps/view/document/message.h"

#include <utility>

namespace palpate::view {

Message::Message(std::string text, Mark mark) {
    if (!text.empty())
        parts_.push_back({std::move(text), mark});
}

Message::Message(std::string text) : Message(std::move(text), Mark::none) {}

Message Message::name(std::string name) {
    return {std::move(name), Mark::name};
}

Message Message::of_files(std::string text) {
    return {std::move(text), Mark::notes};
}

Message Message::why(const Error& error) {
    return {error.message, Mark::reason};
}

Message& Message::operator+=(const Message& more) {
    parts_.insert(parts_.end(), more.parts_.begin(), more.parts_.end());
    return *this;
}

std::string Message::shown(bool names_hidden) const {
    std::string text;
    for (const Part& part : parts_)
        switch (names_hidden ? part.mark : Mark::none) {
            case Mark::none:
                text += part.text;
                break;
            case Mark::name:
                text += "(name hidden)";
                break;
            case Mark::notes:
                text += "(notes about the files are hidden)";
                break;
            case Mark::reason:
                text += "not done, for a reason that names files";
                break;
        }
    return text;
}

} // namespace palpate::view
