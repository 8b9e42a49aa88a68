#pragma once
// Long work done a slice at a time: a thread of its own that waits wherever it has done as much as it was let.
#include <condition_variable>
#include <exception>
#include <functional>
#include <limits>
#include <mutex>
#include <thread>

namespace cairn {

// What long work counts itself with.
class Pace {
public:
    // So much more is done. Returns once as much has been let, or the work has been given up.
    void spend(double amount);
    // The work is wanted no more, or has itself found that it leads nowhere: it should return as soon as it may.
    bool isGivenUp() const { return isGivenUp_; }
    void giveUp() { isGivenUp_ = true; }

private:
    friend class SlicedWork;
    std::mutex mutex_;
    std::condition_variable turned_;
    double allowed_ = 0;
    double spent_ = 0;
    bool waits_ = false;  // until more is let
    bool hasEnded_ = false;
    bool isGivenUp_ = false;  // written by the work, or while it waits
};

// At any time either the work runs or who waits for it. How far it comes hangs on what it counts, never on a clock, and
// so do all answers.
class SlicedWork {
public:
    // Nothing is begun before run(). Where the system gives no thread, all is done at once, and told as if in slices.
    explicit SlicedWork(std::function<void(Pace&)> work) : work_(std::move(work)) {}
    ~SlicedWork();  // gives up what has not ended
    SlicedWork(const SlicedWork&) = delete;
    SlicedWork& operator=(const SlicedWork&) = delete;

    // Lets it do `amount` more. True: it has ended, and that took no more than it has been let. What it throws is
    // thrown on.
    bool run(double amount);

private:
    void begin();
    void work();

    Pace pace_;
    std::function<void(Pace&)> work_;
    std::exception_ptr thrown_;
    std::thread thread_;
    bool hasBegun_ = false;
};

}  // namespace cairn
