// cairn_bench_soak: a world whose 500 bodies come and go, for as long as is asked. Fails where memory grows or where
// the slowest hundredth of the steps takes over three times the median.
//   cairn_bench_soak [seconds]    default: 1800
#include <cairn/cairn.hpp>

#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <random>

namespace cairn::bench {
namespace {

constexpr std::size_t most = 500;
constexpr int swapsAStep = 5;

double threadSeconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double residentMegabytes() {
    long pages = 0;
    long resident = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident;
    return 1e-6 * static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// A bin 12 m wide with boxes, balls and capsules in it, of which some are swapped for others before every step, some
// with a rope between them.
class Bin {
public:
    Bin() {
        world_.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
        for (const double side : {-1.0, 1.0}) {
            addWall({0.5, 20, 7}, {6.5 * side, 20, 0});
            addWall({6, 20, 0.5}, {0, 20, 6.5 * side});
        }
    }

    // s of this thread, that the swaps and the step took: what else the machine does is not in it.
    double step() {
        const double start = threadSeconds();
        for (int k = 0; k < swapsAStep; ++k) {
            if (bodies_.size() == most) {
                const std::size_t place = random_() % most;
                world_.remove(bodies_[place]);
                bodies_[place] = bodies_.back();
                bodies_.pop_back();
            }
            add();
        }
        isFinite_ = isFinite_ && (world_.step(1.0 / 60).flags & (FlagNonFinite | FlagRefused)) == 0;
        return threadSeconds() - start;
    }
    bool isFull() const { return bodies_.size() == most; }
    bool isFinite() const { return isFinite_; }
    const StepCounts& counts() const { return world_.report().counts; }

private:
    double uniform(double low, double high) { return low + (high - low) * 0x1p-64 * static_cast<double>(random_()); }
    void addWall(const Vec3d& half, const Vec3d& position) {
        world_.add({.type = BodyType::Static, .shapes = {box(half)}, .position = position});
    }
    void add() {
        const std::array<Shape, 3> shapes = {box(Vec3d::Constant(0.3)), sphere(0.3), capsule(0.2, 0.2)};
        const BodyId id = world_.add({.shapes = {shapes[random_() % shapes.size()]},
                                      .position = {uniform(-5, 5), uniform(6, 12), uniform(-5, 5)},
                                      .mass = 1});
        if (!bodies_.empty() && random_() % 10 == 0) {
            world_.add(DistanceDef{.a = bodies_.back(), .b = id, .lower = 0, .upper = 20});
        }
        bodies_.push_back(id);
    }

    Worldd world_;
    std::vector<BodyId> bodies_;
    std::mt19937_64 random_{1};
    bool isFinite_ = true;
};

int soak(double seconds) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
    Bin bin;
    std::vector<double> times;
    double memoryBefore = 0;  // of when the bin had been full for a tenth of the time
    long steps = 0;
    while (elapsed() < seconds) {
        const double time = bin.step();
        ++steps;
        if (bin.isFull() && elapsed() > 0.1 * seconds) {
            memoryBefore = memoryBefore > 0 ? memoryBefore : residentMegabytes();
            times.push_back(time);
        }
    }
    if (times.empty()) {
        std::fprintf(stderr, "the bin was not full within %g s: give more\n", seconds);
        return 2;
    }
    // Room for the times themselves is not the world's.
    const double own = 1e-6 * static_cast<double>(times.capacity() * sizeof(double));
    const double memoryAfter = residentMegabytes() - own;
    std::sort(times.begin(), times.end());
    const double median = times[times.size() / 2];
    const double p99 = times[times.size() * 99 / 100];
    std::printf(
        "%ld steps, %d bodies, %d contacts; step median %.3f ms, p99 %.3f ms (%.2f times), worst %.3f ms; "
        "memory %.1f MB, then %.1f MB\n",
        steps, bin.counts().bodies, bin.counts().contacts, 1e3 * median, 1e3 * p99, p99 / median, 1e3 * times.back(),
        memoryBefore, memoryAfter);
    const bool isFlat = memoryAfter < 1.1 * memoryBefore + 1;
    const bool isEven = p99 <= 3 * median;
    std::printf("%s%s%s%s", isFlat ? "" : "memory grows\n", isEven ? "" : "steps are uneven\n",
                bin.isFinite() ? "" : "a body went non-finite\n", isFlat && isEven && bin.isFinite() ? "holds\n" : "");
    return isFlat && isEven && bin.isFinite() ? 0 : 1;
}

}  // namespace
}  // namespace cairn::bench

int main(int argc, char** argv) {
    return cairn::bench::soak(argc > 1 ? std::atof(argv[1]) : 1800);
}
