#pragma once

#include <string>
#include <vector>

#include "engine/base/error.h"

namespace palpate::view {

// A text for a person in which the parts that may tell who a patient is are marked: names of files
// and folders, what readers said about files, and why reading or writing failed. A window can hide
// those parts.
class Message {
 public:
    Message() = default;
    Message(const char* text) : Message(std::string(text)) {}
    Message(std::string text); // without names

    static Message name(std::string name);     // of a file or a folder
    static Message of_files(std::string text); // a reader's notes
    static Message why(const Error& error);    // of reading or writing files

    Message& operator+=(const Message& more);
    friend Message operator+(Message a, const Message& b) { return a += b; }
    friend bool operator==(const Message&, const Message&) = default;

    bool empty() const { return parts_.empty(); }
    std::string shown(bool names_hidden) const;

 private:
    enum class Mark { none, name, notes, reason };
    struct Part {
        std::string text;
        Mark mark;
        friend bool operator==(const Part&, const Part&) = default;
    };
    Message(std::string text, Mark mark);

    std::vector<Part> parts_; // none of them is empty
};

} // namespace palpate::view
