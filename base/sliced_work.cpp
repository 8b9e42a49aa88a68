#include "base/sliced_work.hpp"

#include <system_error>
#include <utility>

namespace cairn {

void Pace::spend(double amount) {
    std::unique_lock lock(mutex_);
    spent_ += amount;
    if (spent_ <= allowed_ || isGivenUp_) {
        return;
    }
    waits_ = true;
    turned_.notify_all();
    turned_.wait(lock, [&] { return spent_ <= allowed_ || isGivenUp_; });
    waits_ = false;
}

void SlicedWork::work() {
    try {
        work_(pace_);
    } catch (...) {
        thrown_ = std::current_exception();
    }
    const std::lock_guard lock(pace_.mutex_);
    pace_.hasEnded_ = true;
    pace_.turned_.notify_all();
}

void SlicedWork::begin() {
    hasBegun_ = true;
    try {
        thread_ = std::thread([this] { work(); });
    } catch (const std::system_error&) {
        const double allowed = pace_.allowed_;
        pace_.allowed_ = std::numeric_limits<double>::infinity();
        work();
        pace_.allowed_ = allowed;
    }
}

bool SlicedWork::run(double amount) {
    {
        std::unique_lock lock(pace_.mutex_);
        pace_.allowed_ += amount;
        if (hasBegun_) {
            pace_.turned_.notify_all();
        }
    }
    if (!hasBegun_) {
        begin();
    }
    std::unique_lock lock(pace_.mutex_);
    pace_.turned_.wait(lock, [&] { return pace_.hasEnded_ || (pace_.waits_ && pace_.spent_ > pace_.allowed_); });
    if (!pace_.hasEnded_ || pace_.spent_ > pace_.allowed_) {
        return false;
    }
    if (thrown_) {
        std::rethrow_exception(std::exchange(thrown_, nullptr));
    }
    return true;
}

SlicedWork::~SlicedWork() {
    {
        const std::lock_guard lock(pace_.mutex_);
        pace_.isGivenUp_ = true;
        pace_.turned_.notify_all();
    }
    if (thread_.joinable()) {
        thread_.join();
    }
}

}  // namespace cairn
