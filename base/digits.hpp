#pragma once
// Numbers in messages.
#include <charconv>
#include <concepts>
#include <string>

namespace cairn {

// As few digits as give the number back.
template <std::floating_point S>
std::string digits(S x) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, x).ptr};
}

}  // namespace cairn
