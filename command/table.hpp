#pragma once
// Numbers and tables in words.
#include <optional>
#include <string>
#include <vector>

namespace cairn {

// Rows of words in columns as wide as their widest word; the first row is the head. The first column and those whose
// head ends in '<' (which is not printed) are flush left, others flush right.
std::string table(const std::vector<std::vector<std::string>>& rows);

std::string fixed(double x, int decimals);
// Three significant digits, or a dash for nothing.
std::string brief(const std::optional<double>& x);

}  // namespace cairn
