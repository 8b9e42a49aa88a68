#include "base/parallel.hpp"
#include "base/check.hpp"

#include <string>

namespace cairn {

std::shared_ptr<JobSystem> makeTbbJobSystem(int threads) {
    if (threads < 1 || threads > 1024) {
        throw InputError("threads", std::to_string(threads), "give a number from 1 to 1024");
    }
    return newJobSystem(threads);
}

}  // namespace cairn
