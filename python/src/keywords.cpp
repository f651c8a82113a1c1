#include "python/src/keywords.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/base/option_name.h"
#include "python/src/work.h"

namespace palpate::python {

namespace {

// Wrong values of one keyword, by what they are.
class WrongKind {};

std::string keyword_of(const CLI::Option& option) {
    return text_of(Option{option.get_lnames().front()});
}

bool is_text(const py::handle& value) {
    return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
}
bool is_sequence(const py::handle& value) {
    return !is_text(value) && !py::isinstance<py::dict>(value) && py::hasattr(value, "__iter__");
}

std::string text_of_one(const py::handle& value) {
    if (is_text(value))
        return py::str(py::module_::import("os").attr("fspath")(value));
    if (py::isinstance<py::dict>(value))
        return py::str(py::module_::import("json").attr("dumps")(value));
    if (!is_sequence(value)) {
        if (py::hasattr(value, "__index__"))
            return py::str(value.attr("__index__")());
        const double number = py::float_(py::reinterpret_borrow<py::object>(value));
        const bool is_whole = number == std::floor(number) && std::abs(number) < 1e15;
        return is_whole ? fmt::format("{:.0f}", number) : fmt::format("{}", number);
    }
    std::string all;
    for (const py::handle& item : value)
        all += (all.empty() ? "" : ",") + text_of_one(item);
    return all;
}

// An option's values: one, unless it is a sequence of texts or of sequences.
std::vector<std::string> texts_of(const py::handle& value) {
    if (!is_sequence(value))
        return {text_of_one(value)};
    const py::list items(py::reinterpret_borrow<py::object>(value));
    const bool is_one = std::none_of(items.begin(), items.end(), [](const py::handle& item) {
        return is_text(item) || is_sequence(item);
    });
    if (is_one)
        return {text_of_one(items)};
    std::vector<std::string> texts;
    for (const py::handle& item : items)
        texts.push_back(text_of_one(item));
    return texts;
}

// The sentence of the command line about one option, with the option's keyword.
std::string sentence_of(const CLI::Option& option, const CLI::ParseError& error) {
    std::string text = error.what();
    for (const std::string& name : {option.get_name(), "--" + option.get_lnames().front()})
        if (const size_t at = text.find(name); at != text.npos)
            return text.replace(at, name.size(), keyword_of(option));
    return fmt::format("{}: {}", keyword_of(option), text);
}

void give(CLI::Option& option, const py::handle& value) {
    const bool is_flag = option.get_items_expected_max() == 0;
    std::vector<std::string> texts;
    try {
        if (value.is(py::bool_(true)) && !is_flag)
            throw WrongKind();
        texts = value.is(py::bool_(true)) ? std::vector<std::string>{""} : texts_of(value);
    } catch (const WrongKind&) {
        throw Failure(fmt::format("{}: expected a value, found True", keyword_of(option)));
    } catch (const py::error_already_set& error) {
        if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError))
            throw;
        throw Failure(
            fmt::format("{}: expected a number, a text or a list, found {}", keyword_of(option),
                        std::string(py::repr(py::reinterpret_borrow<py::object>(value)))));
    }
    try {
        for (const std::string& text : texts)
            option.add_result(is_flag ? option.get_flag_value(option.get_lnames().front(), text)
                                      : text);
        option.run_callback();
    } catch (const CLI::ParseError& error) {
        throw Failure(sentence_of(option, error));
    }
}

void check_together(const CLI::App& app) {
    for (const CLI::Option* option : app.get_options()) {
        if (option->count() == 0 || option->get_lnames().empty())
            continue;
        for (const CLI::Option* other : option->get_needs())
            if (other->count() == 0)
                throw Failure(
                    fmt::format("{} requires {}", keyword_of(*option), keyword_of(*other)));
        for (const CLI::Option* other : option->get_excludes())
            if (other->count() > 0)
                throw Failure(
                    fmt::format("{} excludes {}", keyword_of(*option), keyword_of(*other)));
    }
}

} // namespace

void take_keywords(CLI::App& app, const py::dict& keywords) {
    for (const auto& [key, value] : keywords) {
        const std::string keyword = py::str(key);
        std::string name = keyword;
        std::replace(name.begin(), name.end(), '_', '-');
        CLI::Option* option = app.get_option_no_throw("--" + name);
        if (!option || name.empty())
            throw Failure(
                fmt::format("{}: expected an option of palpate render by name, with _ "
                            "for -; none has this name",
                            keyword));
        if (!value.is_none() && !value.is(py::bool_(false)))
            give(*option, value);
    }
    check_together(app);
    try {
        app.parse(std::vector<std::string>{}); // what is checked over all options
    } catch (const CLI::ParseError& error) {
        throw Failure(error.what());
    }
}

} // namespace palpate::python
