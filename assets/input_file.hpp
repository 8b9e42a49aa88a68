#pragma once
// Files that are read whole, of which the name may be somebody else's.
#include <filesystem>
#include <string>

namespace cairn {

// Throws InputError whose field is the file's name for what is not there, may not be read, or is no regular file: a
// pipe or a device would be waited for.
std::string readInputFile(const std::filesystem::path& file);

// Whether a file lies in a folder or below it, links followed where they lead somewhere.
bool isWithin(const std::filesystem::path& folder, const std::filesystem::path& file);

}  // namespace cairn
