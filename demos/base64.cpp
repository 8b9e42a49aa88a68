#include "demos/base64.hpp"

#include <cstdint>
#include <string_view>

namespace cairn {

namespace {

constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::string toBase64(const std::string& bytes) {
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t three = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            out += i + k > bytes.size() ? '=' : letters[three >> (18 - 6 * k) & 63u];
        }
    }
    return out;
}

std::optional<std::string> fromBase64(const std::string& text) {
    if (text.size() % 4 != 0) {
        return {};
    }
    std::size_t padding = 0;
    while (padding < 2 && padding < text.size() && text[text.size() - 1 - padding] == '=') {
        ++padding;
    }
    std::string out;
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool padded = i + padding >= text.size();
        const std::size_t value = padded ? 0 : letters.find(text[i]);
        if (value == std::string_view::npos) {
            return {};
        }
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        if (i % 4 == 3) {
            for (int shift = 16; shift >= 0; shift -= 8) {
                out += static_cast<char>(bits >> shift & 255u);
            }
            bits = 0;
        }
    }
    out.resize(out.size() - padding);
    return out;
}

}  // namespace cairn
