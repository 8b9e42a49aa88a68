#pragma once
// Cairn's version, by semantic versioning: MAJOR changes where code written against the last one may not compile or
// files it wrote may not be read, MINOR where something was added, PATCH where something was mended. While MAJOR is 0,
// MINOR may break both.
// This is the one place that has the numbers: CMake reads them here, each from a line of its own (cmake/version.cmake).

#define CAIRN_VERSION_MAJOR 0
#define CAIRN_VERSION_MINOR 2
#define CAIRN_VERSION_PATCH 0

// In words, so that it is known at compile time which version the headers are of. Two levels, or the names would be
// put into words instead of their numbers.
#define CAIRN_VERSION_WORD(number) #number
#define CAIRN_VERSION_WORDS(major, minor, patch) \
    CAIRN_VERSION_WORD(major) "." CAIRN_VERSION_WORD(minor) "." CAIRN_VERSION_WORD(patch)

namespace cairn {

inline constexpr const char* version =
    CAIRN_VERSION_WORDS(CAIRN_VERSION_MAJOR, CAIRN_VERSION_MINOR, CAIRN_VERSION_PATCH);

}  // namespace cairn

#undef CAIRN_VERSION_WORDS
#undef CAIRN_VERSION_WORD
