#pragma once
// CAIRN_CHECK guards against a programmer's mistake inside the engine: it prints the place and ends the program. It is
// on in every build type, because a game that goes on with a broken invariant is harder to mend than one that stops.
// Bad input at the edge is an InputError instead: it names the field, the value and the remedy.
#include <stdexcept>
#include <string>

namespace cairn {

[[noreturn]] void checkFailed(const char* condition, const char* message, const char* file, int line);

class InputError : public std::invalid_argument {
public:
    InputError(const std::string& field, const std::string& value, const std::string& remedy)
        : std::invalid_argument(field + " = " + value + ": " + remedy), field_(field) {}
    const std::string& field() const { return field_; }

private:
    std::string field_;
};

}  // namespace cairn

#define CAIRN_CHECK(condition, message)                                    \
    do {                                                                   \
        if (!(condition)) {                                                \
            ::cairn::checkFailed(#condition, message, __FILE__, __LINE__); \
        }                                                                  \
    } while (false)
