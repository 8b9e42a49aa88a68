#include "base/output_file.hpp"
#include "command/command.hpp"

#include <cstdio>

namespace cairn {

std::string table(const std::vector<std::vector<std::string>>& rows) {
    std::vector<std::vector<std::string>> cells = rows;
    std::vector<bool> left;
    for (std::string& head : cells.front()) {
        left.push_back(left.empty() || head.ends_with('<'));
        if (head.ends_with('<')) {
            head.pop_back();
        }
    }
    std::vector<std::size_t> widths(left.size(), 0);
    for (const auto& row : cells) {
        for (std::size_t i = 0; i < row.size(); ++i) {
            widths[i] = std::max(widths[i], row[i].size());
        }
    }
    std::string text;
    for (const auto& row : cells) {
        std::string line;
        for (std::size_t i = 0; i < row.size(); ++i) {
            const std::string space(widths[i] - row[i].size(), ' ');
            line += (i > 0 ? "  " : "") + (left[i] ? row[i] + space : space + row[i]);
        }
        line.erase(line.find_last_not_of(' ') + 1);
        text += line + "\n";
    }
    return text;
}

std::string fixed(double x, int decimals) {
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", decimals, x);
    return text;
}

std::string brief(const std::optional<double>& x) {
    if (!x) {
        return "-";
    }
    char text[64];
    std::snprintf(text, sizeof text, "%.3g", *x);
    return text;
}

void writeJson(const nlohmann::ordered_json& json, const std::string& file) {
    const std::string text = json.dump(2) + "\n";
    if (file == "-") {
        std::fwrite(text.data(), 1, text.size(), stdout);
        return;
    }
    writeText("--json", text, file);
}

void writeText(const char* option, const std::string& text, const std::string& file) {
    writeFile(option, file, text);
}

void makeFolder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!std::filesystem::is_directory(folder)) {
        throw InputError("--out", folder.string(), "the folder cannot be made: " + error.message());
    }
}

}  // namespace cairn
