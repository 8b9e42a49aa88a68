#pragma once
// Bad input at the edge: names the field, the value and the remedy.
#include <stdexcept>
#include <string>

namespace cairn {

class InputError : public std::invalid_argument {
public:
    InputError(const std::string& field, const std::string& value, const std::string& remedy)
        : std::invalid_argument(field + " = " + value + ": " + remedy), field_(field) {}
    const std::string& field() const { return field_; }

private:
    std::string field_;
};

}  // namespace cairn
