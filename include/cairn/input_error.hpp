#pragma once
// Bad input at the edge: names the field, the value and the remedy.
#include <stdexcept>
#include <string>

namespace cairn {

class InputError : public std::invalid_argument {
public:
    InputError(const std::string& field, const std::string& value, const std::string& remedy)
        : std::invalid_argument(printable(field + " = " + value + ": " + remedy)),
          field_(field),
          value_(value),
          remedy_(remedy) {}
    const std::string& field() const { return field_; }
    const std::string& value() const { return value_; }
    const std::string& remedy() const { return remedy_; }

private:
    // Names come from files: what a terminal would obey, and what would end the text, is spelt out.
    static std::string printable(const std::string& text) {
        std::string out;
        for (const char c : text) {
            const unsigned code = static_cast<unsigned char>(c);
            if ((code < 0x20 && c != '\n') || code == 0x7f) {
                constexpr const char* digits = "0123456789abcdef";
                out += {'\\', 'x', digits[code / 16], digits[code % 16]};
            } else {
                out += c;
            }
        }
        return out;
    }

    std::string field_;
    std::string value_;
    std::string remedy_;
};

}  // namespace cairn
