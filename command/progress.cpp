#include "command/command.hpp"

#include <unistd.h>
#include <cstdio>

namespace cairn {

Progress::Progress(std::string title, int total)
    : title_(std::move(title)),
      total_(std::max(total, 1)),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
    if (shown_) {
        std::fprintf(stderr, "\r\033[K");
    }
}

void Progress::at(int done) {
    if (!terminal_) {
        return;
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const int percent = static_cast<int>(100.0 * done / total_);
    if (seconds < 1 || percent == lastPercent_ || done <= 0) {
        return;
    }
    shown_ = true;
    lastPercent_ = percent;
    const int width = 30;
    const int filled = width * percent / 100;
    const std::string bar =
        std::string(static_cast<std::size_t>(filled), '=') + std::string(static_cast<std::size_t>(width - filled), ' ');
    const double left = seconds * (total_ - done) / done;
    std::fprintf(stderr, "\r\033[K%s [%s] %d %%, %.0f s left", title_.c_str(), bar.c_str(), percent, left);
    std::fflush(stderr);
}

}  // namespace cairn
