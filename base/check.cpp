#include "base/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace cairn {

void checkFailed(const char* condition, const char* message, const char* file, int line) {
    std::fprintf(stderr, "%s:%d: check failed: %s (%s)\n", file, line, condition, message);
    std::abort();
}

}  // namespace cairn
