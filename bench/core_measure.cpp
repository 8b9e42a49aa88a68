#include "core_measure.hpp"

#include "exact_depth.hpp"

#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <numeric>

namespace {

std::atomic<long> allocations = 0;
std::atomic<bool> counting = false;

void countAllocation() {
    if (counting.load(std::memory_order_relaxed)) {
        allocations.fetch_add(1, std::memory_order_relaxed);
    }
}

}  // namespace

// malloc itself is replaced, not operator new alone: Eigen's matrices do not pass through the latter.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) noexcept {
    countAllocation();
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
    countAllocation();
    return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) noexcept {
    countAllocation();
    return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
    countAllocation();
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
    countAllocation();
    *out = __libc_memalign(alignment, size);
    return *out ? 0 : ENOMEM;
}
}

namespace cairn::bench {
namespace {

constexpr double dt = 1.0 / 60;

double now(bool cpuClock) {
    timespec t{};
    clock_gettime(cpuClock ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Bytes of this process's own pages. smaps_rollup counts them; the sums in status lag behind by some hundred KB.
double residentBytes() {
    std::ifstream file("/proc/self/smaps_rollup");
    std::string word;
    double kilobytes = 0;
    while (file >> word) {
        if (word == "Anonymous:" && file >> kilobytes) {
            break;
        }
    }
    return 1024 * kilobytes;
}

template <class S>
class WorldFiller final : public Filler {
public:
    WorldFiller(World<S>& world, const Case& c) : world_(world), apart_(c.apart), keepsDefs_(c.look > 0) {}

    BodyId add(const BodyDef& def) override {
        if (keepsDefs_) {
            kept_.push_back({world_.add(def), def});
            return kept_.back().id;
        }
        if (!apart_) {
            return world_.add(def);
        }
        BodyDef moved = def;
        moved.position = 4 * def.position + Vec3d(0, def.type == BodyType::Static ? -100 : 100, 0);
        return world_.add(moved);
    }
    void add(const BallDef& def) override {
        world_.add(def);
        hooks_.push_back({def.a, def.b, inBody(def.a, def.anchor), inBody(def.b, def.anchor)});
    }

    // m, of the widest open joint as the poses have it: a report may tell of a moment before the last motion.
    double widestGap() const {
        double widest = 0;
        for (const Hook& hook : hooks_) {
            widest = std::max(widest, (inWorld(hook.a, hook.anchorA) - inWorld(hook.b, hook.anchorB)).norm());
        }
        return widest;
    }

    Depths depths() const {
        std::vector<Placed> placed;
        for (const Kept& body : kept_) {
            placed.push_back({body.def.shapes, pose(body.id), body.def.filter, body.def.type == BodyType::Dynamic});
        }
        std::vector<std::pair<int, int>> joined;
        for (const Hook& hook : hooks_) {
            joined.push_back(std::minmax(place(hook.a), place(hook.b)));
        }
        std::sort(joined.begin(), joined.end());
        return exactDepth(placed, joined);
    }
    // m, of the dynamic body that is farthest from where it began.
    double moved() const {
        double farthest = 0;
        for (const Kept& body : kept_) {
            if (body.def.type == BodyType::Dynamic) {
                farthest = std::max(farthest, (pose(body.id).position - body.def.position).norm());
            }
        }
        return farthest;
    }

private:
    struct Hook {
        BodyId a, b;
        Vec3d anchorA, anchorB;  // in each body's frame
    };

    struct Kept {
        BodyId id;
        BodyDef def;
    };

    Posed pose(BodyId id) const {
        const auto pose = world_.pose(id);
        return {pose.position.template cast<double>(), pose.rotation.template cast<double>()};
    }
    Vec3d inBody(BodyId id, const Vec3d& point) const {
        return pose(id).rotation.conjugate() * (point - pose(id).position);
    }
    Vec3d inWorld(BodyId id, const Vec3d& point) const { return pose(id).position + pose(id).rotation * point; }
    // In kept_, whose ids rise.
    int place(BodyId id) const {
        const auto at = std::partition_point(kept_.begin(), kept_.end(), [&](const Kept& k) { return k.id < id; });
        return static_cast<int>(at - kept_.begin());
    }

    World<S>& world_;
    bool apart_, keepsDefs_;
    std::vector<Kept> kept_;
    std::vector<Hook> hooks_;
};

void summarise(std::vector<double> steps, Outcome& out) {
    const auto mean = [](auto begin, auto end) {
        return std::accumulate(begin, end, 0.0) / static_cast<double>(std::max<std::ptrdiff_t>(end - begin, 1));
    };
    out.first = steps.front();
    const auto late = steps.end() - std::max<std::ptrdiff_t>(std::ssize(steps) / 4, 1);
    out.late = mean(late, steps.end());
    out.least = *std::min_element(late, steps.end());
    if (steps.size() > 1) {
        steps.erase(steps.begin());
    }
    out.mean = mean(steps.begin(), steps.end());
    std::sort(steps.begin(), steps.end());
    const auto rank = [&](double share) { return steps[static_cast<std::size_t>(share * (std::ssize(steps) - 1))]; };
    out.median = rank(0.5);
    out.p99 = rank(0.99);
    out.worst = steps.back();
}

template <class S>
Outcome run(const Case& c) {
    Outcome out{};
    std::vector<double> times(static_cast<std::size_t>(c.steps));  // before memory is read
    const double memoryBefore = residentBytes();
    WorldDef def;
    def.threads = c.threads;
    def.sleep.enabled = c.scene->sleep;
    if (!c.solver.empty()) {
        def.solver = solverNamed(c.solver);
    }
    std::visit([&](auto& numbers) { numbers.substeps = c.substeps; }, def.solver);
    if (c.apart) {
        def.gravity = Vec3d::Zero();
    }
    double start = now(c.cpuClock);
    World<S> world(def);
    WorldFiller<S> filler(world, c);
    c.scene->fill(filler, c.count);
    out.build = now(c.cpuClock) - start;
    const int lateSteps = std::max(c.steps / 4, 1);
    int looks = 0;
    for (int i = 0; i < c.steps; ++i) {
        counting = c.threads == 1 && i >= c.steps - lateSteps;  // threads would queue up at the counter
        start = now(c.cpuClock);
        const StepReport& report = world.step(static_cast<S>(dt));
        times[static_cast<std::size_t>(i)] = now(c.cpuClock) - start;
        counting = false;
        out.penetration = std::max(out.penetration, report.error.maxPenetration);
        out.gap = std::max(out.gap, filler.widestGap());
        out.flagged += !report.ok();
        out.contacts = report.counts.contacts;
        out.joints = report.counts.joints;
        if (c.look > 0 && (i % c.look == c.look - 1 || i == c.steps - 1)) {
            const Depths depths = filler.depths();
            out.depth = std::max(out.depth, depths.worst);
            out.meanDepth += depths.mean;
            ++looks;
        }
    }
    out.moved = filler.moved();
    out.meanDepth /= std::max(looks, 1);
    malloc_trim(0);  // what is free is the allocator's
    out.memory = residentBytes() - memoryBefore;
    out.allocations = c.threads == 1 ? static_cast<double>(allocations) / lateSteps : -1;
    summarise(times, out);
    out.state = 14695981039346656037ull;  // FNV-1a
    for (const BodyId id : world.bodies()) {
        ++out.bodies;
        const auto pose = world.pose(id);
        for (const double x : {static_cast<double>(pose.position.x()), static_cast<double>(pose.position.y()),
                               static_cast<double>(pose.position.z()), static_cast<double>(pose.rotation.w())}) {
            out.state = (out.state ^ std::bit_cast<std::uint64_t>(x)) * 1099511628211ull;
        }
    }
    return out;
}

}  // namespace

std::optional<Outcome> measure(const Case& c) {
    int ends[2];
    std::fflush(nullptr);
    if (pipe(ends) != 0) {
        return {};
    }
    const pid_t child = fork();
    if (child == 0) {
        try {
            const Outcome out = c.floats ? run<float>(c) : run<double>(c);
            _exit(write(ends[1], &out, sizeof out) == sizeof out ? 0 : 1);
        } catch (const std::exception& error) {
            std::fprintf(stderr, "%s: %s\n", c.scene->name, error.what());
        }
        _exit(1);
    }
    close(ends[1]);
    Outcome out{};
    const bool whole = read(ends[0], &out, sizeof out) == sizeof out;
    close(ends[0]);
    int status = 0;
    waitpid(child, &status, 0);
    return whole && status == 0 ? std::optional(out) : std::nullopt;
}

}  // namespace cairn::bench
