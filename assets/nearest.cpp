#include "assets/nearest.hpp"

#include <algorithm>
#include <cctype>
#include <numeric>

namespace cairn {

namespace {

// Levenshtein distance that takes capital and small letters as the same.
std::size_t editDistance(const std::string& a, const std::string& b) {
    const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t change = diagonal + (lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
        }
    }
    return row.back();
}

constexpr std::size_t longestWord = 64;  // longer ones are no slip of the finger
constexpr std::size_t maxListed = 24;

}  // namespace

std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
    std::string text;
    if (word.size() <= longestWord) {
        const std::string* best = nullptr;
        std::size_t smallest = std::max<std::size_t>(1, word.size() / 2) + 1;
        for (const std::string& candidate : known) {
            const std::size_t distance = editDistance(word, candidate);
            if (distance < smallest) {
                smallest = distance;
                best = &candidate;
            }
        }
        if (best != nullptr) {
            text = "did you mean \"" + *best + "\"? ";
        }
    }
    if (known.size() <= maxListed) {
        text += known.empty() ? "there are none" : "known:";
        for (const std::string& candidate : known) {
            text += " " + candidate;
        }
    }
    return text;
}

}  // namespace cairn
