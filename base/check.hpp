#pragma once
// CAIRN_CHECK guards against a programmer's mistake inside the engine: it prints the place and ends the program. It is
// on in every build type, because a game that goes on with a broken invariant is harder to mend than one that stops.
// Bad input at the edge is an InputError instead.
#include <cairn/input_error.hpp>

namespace cairn {

[[noreturn]] void checkFailed(const char* condition, const char* message, const char* file, int line);

}  // namespace cairn

#define CAIRN_CHECK(condition, message)                                    \
    do {                                                                   \
        if (!(condition)) {                                                \
            ::cairn::checkFailed(#condition, message, __FILE__, __LINE__); \
        }                                                                  \
    } while (false)
