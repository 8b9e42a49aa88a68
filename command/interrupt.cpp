#include "command/interrupt.hpp"

#include <csignal>
#include <string>

namespace cairn {

namespace {

volatile std::sig_atomic_t noted = 0;

void note(int /*signal*/) {
    noted = 1;
}

void handle(void (*handler)(int)) {
    struct sigaction action {};
    action.sa_handler = handler;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

Interrupt::Interrupt() {
    noted = 0;
    handle(note);
}

Interrupt::~Interrupt() {
    handle(SIG_DFL);
}

bool Interrupt::asked() const {
    return noted != 0;
}

void Interrupt::stopIfAsked(const char* outcome) const {
    if (asked()) {
        throw Interrupted(std::string("interrupted: ") + outcome);
    }
}

}  // namespace cairn
