#pragma once
// Errors that say which part of a scene they are about.
#include <cairn/input_error.hpp>

#include <string>

namespace cairn {

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
