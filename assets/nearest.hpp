#pragma once
// Inside assets/: help with misspelt names.
#include <string>
#include <vector>

namespace cairn {

// `did you mean "friction"? ` when one of the known words is near, else nothing; then, when there are at most 24 known
// words, all of them.
std::string suggestion(const std::string& word, const std::vector<std::string>& known);

}  // namespace cairn
