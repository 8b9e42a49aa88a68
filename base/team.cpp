#include "base/team.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace cairn {
namespace {

// Chunks of a loop for each thread, where its grain allows: the last one to end is waited for.
constexpr std::size_t chunksPerThread = 4;

// For a thread that waits for another one's next word.
class Patience {
public:
    void wait() {
        if (waits_ < spins + yields) {
            ++waits_;
        }
        if (waits_ < spins) {
#if defined(__x86_64__) || defined(__i386__)
            __builtin_ia32_pause();
#endif
        } else if (waits_ < spins + yields) {
            std::this_thread::yield();
        } else {
            std::this_thread::sleep_for(std::chrono::microseconds(50));
        }
    }
    void renew() {
        waits_ = 0;
    }

private:
    static constexpr int spins = 2000;   // some 50 us
    static constexpr int yields = 2000;  // about a millisecond
    int waits_ = 0;
};

class Team final : public JobSystem {
public:
    explicit Team(int threads) : shares_(static_cast<std::size_t>(threads)) {}

    // By the one thread that leads, or from within a loop.
    void parallelFor(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) override {
        const std::size_t threads = shares_.size();
        const std::size_t chunk = std::max({grain, count / (chunksPerThread * threads), std::size_t(1)});
        if (count <= chunk || isLooping_) {
            if (count > 0) {
                body(0, count);
            }
            return;
        }
        isLooping_ = true;
        body_ = &body;
        count_ = count;
        chunk_ = chunk;
        const std::size_t chunks = (count + chunk - 1) / chunk;
        pending_.store(chunks, std::memory_order_relaxed);
        for (std::size_t k = 0; k < threads; ++k) {
            shares_[k].end = (k + 1) * chunks / threads;
            shares_[k].left.store(shares_[k].end - k * chunks / threads, std::memory_order_release);
        }
        takeChunks(0);
        Patience patience;
        while (pending_.load(std::memory_order_acquire) > 0) {
            patience.wait();
        }
        isLooping_ = false;
        if (error_) {
            std::rethrow_exception(std::exchange(error_, nullptr));
        }
    }
    int threadCount() const override { return static_cast<int>(shares_.size()); }

    // Until the team is dismissed.
    void help() {
        const std::size_t own = helpers_.fetch_add(1, std::memory_order_relaxed) + 1;
        Patience patience;
        while (!isDismissed_.load(std::memory_order_acquire)) {
            if (takeChunks(own)) {
                patience.renew();
            } else {
                patience.wait();
            }
        }
    }
    void dismiss() { isDismissed_.store(true, std::memory_order_release); }

private:
    // Of a loop, what one thread takes first, from loop to loop the same, so that its data stay in that core's caches;
    // on a cache line of its own. Once a thread is through with its own it takes of the others'.
    struct alignas(64) Share {
        std::atomic<std::size_t> left = 0;  // chunks that nobody has taken
        std::size_t end = 0;                // the chunk after its last
    };

    // False: there were none.
    bool takeChunks(std::size_t own) {
        bool any = false;
        for (std::size_t k = 0; k < shares_.size(); ++k) {
            while (takeChunk(shares_[(own + k) % shares_.size()])) {
                any = true;
            }
        }
        return any;
    }
    bool takeChunk(Share& share) {
        std::size_t left = share.left.load(std::memory_order_relaxed);
        do {
            if (left == 0) {
                return false;
            }
        } while (!share.left.compare_exchange_weak(left, left - 1, std::memory_order_acquire));
        // The loop does not end before this chunk has: what it is made of stays.
        const std::size_t begin = (share.end - left) * chunk_;
        try {
            (*body_)(begin, std::min(count_, begin + chunk_));
        } catch (...) {
            const std::lock_guard lock(errorMutex_);
            error_ = error_ ? error_ : std::current_exception();
        }
        pending_.fetch_sub(1, std::memory_order_acq_rel);
        return true;
    }

    std::vector<Share> shares_;  // by thread, the leader's first
    // The loop that is on.
    const std::function<void(std::size_t, std::size_t)>* body_ = nullptr;
    std::size_t count_ = 0;
    std::size_t chunk_ = 0;
    bool isLooping_ = false;
    std::mutex errorMutex_;
    std::exception_ptr error_;
    std::atomic<std::size_t> helpers_ = 0;
    alignas(64) std::atomic<std::size_t> pending_ = 0;  // chunks that have not ended
    alignas(64) std::atomic<bool> isDismissed_ = false;
};

}  // namespace

void leadTeam(JobSystem& jobs, FunctionRef<void(JobSystem&)> lead) {
    // A game's own job system may say anything.
    constexpr int mostThreads = 1024;
    const int threads = std::min(jobs.threadCount(), mostThreads);
    if (threads <= 1) {
        lead(jobs);
        return;
    }
    Team team(threads);
    std::atomic<bool> isLed = false;
    std::exception_ptr error;
    const auto take = [&](std::size_t, std::size_t) {
        if (isLed.exchange(true)) {
            team.help();
            return;
        }
        try {
            lead(team);
        } catch (...) {
            error = std::current_exception();
        }
        team.dismiss();
    };
    jobs.parallelFor(static_cast<std::size_t>(threads), 1, take);
    if (error) {
        std::rethrow_exception(error);
    }
}

}  // namespace cairn
