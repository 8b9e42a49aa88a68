#pragma once
// Ctrl-C for those who have something to put in order first.
#include <stdexcept>

namespace cairn {

// While one of these lives, the first Ctrl-C (or SIGTERM) is a question that the work answers where it can stop; the
// second ends the program.
class Interrupt {
public:
    Interrupt();
    ~Interrupt();
    Interrupt(const Interrupt&) = delete;
    Interrupt& operator=(const Interrupt&) = delete;
    bool asked() const;
    // Throws Interrupted with what became of the work.
    void stopIfAsked(const char* outcome) const;
};

struct Interrupted : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// The exit code of who was asked to end, as shells have it for SIGINT.
inline constexpr int exitInterrupted = 130;

}  // namespace cairn
