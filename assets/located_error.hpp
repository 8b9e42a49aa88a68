#pragma once
// Errors that say which part of a scene they are about.
#include <cairn/input_error.hpp>

#include <charconv>
#include <string>

namespace cairn {

// As few digits as give the number back.
inline std::string digits(double x) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, x).ptr};
}

inline std::string quoted(const std::string& text) {
    return "\"" + text + "\"";
}

// Runs `make`; an InputError inside is thrown again with `where` before its field.
template <class Make>
auto locate(const std::string& where, const Make& make) {
    try {
        return make();
    } catch (const InputError& error) {
        throw InputError(where + " (" + error.field() + ")", error.value(), error.remedy());
    }
}

}  // namespace cairn
