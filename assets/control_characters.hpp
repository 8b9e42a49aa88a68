#pragma once
// Characters that a terminal obeys: those below a blank, delete, and U+0080 to U+009F, which are two bytes in UTF-8.
#include <string>

namespace cairn {

inline bool isControl(const std::string& text, std::size_t at) {
    const auto code = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0; };
    return code(at) < 0x20 || code(at) == 0x7f || (code(at) == 0xc2 && code(at + 1) >= 0x80 && code(at + 1) < 0xa0);
}

inline bool hasControls(const std::string& text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (isControl(text, i)) {
            return true;
        }
    }
    return false;
}

// With \x1b and the like in their place; lines stay.
inline std::string printable(const std::string& text) {
    constexpr const char* hex = "0123456789abcdef";
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (!isControl(text, i) || text[i] == '\n') {
            out += text[i];
            continue;
        }
        i += static_cast<unsigned char>(text[i]) == 0xc2 ? 1 : 0;
        const unsigned code = static_cast<unsigned char>(text[i]);
        out += {'\\', 'x', hex[code / 16], hex[code % 16]};
    }
    return out;
}

}  // namespace cairn
