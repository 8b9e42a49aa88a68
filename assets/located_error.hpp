#pragma once
// Errors that say which part of a scene they are about.
#include <cairn/input_error.hpp>

#include <new>
#include <string>

namespace cairn {

inline std::string quoted(const std::string& text) {
    return "\"" + text + "\"";
}

// Runs `make`; an InputError inside is thrown again with `where` before its field, and what memory does not hold is
// one.
template <class Make>
auto locate(const std::string& where, const Make& make) {
    try {
        return make();
    } catch (const InputError& error) {
        throw InputError(where + " (" + error.field() + ")", error.value(), error.remedy());
    } catch (const std::bad_alloc&) {
        throw InputError(where, "(too large)", "there is not enough memory for it: make it smaller");
    }
}

}  // namespace cairn
