#pragma once
// Bytes as text (RFC 4648, with padding), for JSON and for pages.
#include <optional>
#include <string>

namespace cairn {

std::string toBase64(const std::string& bytes);
// Empty if the text is no base64.
std::optional<std::string> fromBase64(const std::string& text);

}  // namespace cairn
