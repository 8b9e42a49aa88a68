#pragma once
// Inside advice/: style and scripts of pages, which are files beside this one.
#include <string_view>

namespace cairn::page_text {

// Of all pages.
extern const std::string_view style;
extern const std::string_view common;

// Of one page each.
extern const std::string_view bench;
extern const std::string_view tune;

}  // namespace cairn::page_text
