// cairn_bench_growth: how the time of every call and of every stage of a step grows with the number of bodies. A row is
// a call; a column is a number of bodies; the last is the exponent p of time ~ n^p between the first and the last. A
// call about one body should have 0 (a few tenths are caches and trees), a whole step 1.
//   cairn_bench_growth [count...]    default: 1000 4000 16000 100000
#include <cairn/cairn.hpp>

#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

namespace cairn::bench {
namespace {

constexpr double dt = 1.0 / 60;
constexpr int columnHeight = 4;

class Table {
public:
    explicit Table(std::vector<int> counts) : counts_(std::move(counts)) {}

    void begin(std::size_t column) { column_ = column; }
    // value: us, or what the row's name says.
    void note(const std::string& row, double value) {
        auto place = std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.name == row; });
        if (place == rows_.end()) {
            place = rows_.insert(rows_.end(), {row, std::vector<double>(counts_.size(), 0)});
        }
        place->values[column_] += value;
    }
    void print() const {
        std::printf("%-44s", "us a call, at bodies:");
        for (const int count : counts_) {
            std::printf(" %10d", count);
        }
        std::printf("   exponent\n");
        for (const Row& row : rows_) {
            std::printf("%-44s", row.name.c_str());
            for (const double value : row.values) {
                std::printf(" %10.3g", value);
            }
            const double span = std::log(double(counts_.back()) / double(counts_.front()));
            const double growth = std::log(row.values.back() / row.values.front());
            std::printf(row.values.front() > 0 && span > 0 ? "   %8.2f\n" : "          -\n", growth / span);
        }
    }

private:
    struct Row {
        std::string name;
        std::vector<double> values;
    };
    std::vector<int> counts_;
    std::vector<Row> rows_;
    std::size_t column_ = 0;
};

// us, that one of `times` calls of f(k) takes.
template <class F>
double timed(std::size_t times, F f) {
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t k = 0; k < times; ++k) {
        f(k);
    }
    const std::chrono::duration<double, std::micro> all = std::chrono::steady_clock::now() - start;
    return all.count() / static_cast<double>(times);
}

double residentBytes() {
    long pages = 0;
    long resident = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident;
    return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

BodyDef boxAt(const Vec3d& position) {
    return {.shapes = {box(Vec3d::Constant(0.5))}, .position = position, .mass = 1};
}

Vec3d placeOf(int i, int n) {
    const int side = static_cast<int>(std::ceil(std::sqrt(double(n) / columnHeight)));
    const int column = i / columnHeight;
    const int row = column / side;
    return {2.0 * (column % side), 0.5 + i % columnHeight, 2.0 * row};
}

// Columns of four boxes on one floor: each body has two neighbours, the floor a quarter of all.
struct Columns {
    Worldd world;
    BodyId floor;
    std::vector<BodyId> boxes;

    Columns(int n, bool sleep)
        : world({.sleep = {.enabled = sleep}}),
          floor(world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}})) {
        for (int i = 0; i < n; ++i) {
            boxes.push_back(world.add(boxAt(placeOf(i, n))));
        }
    }
    // Different bodies all over the world.
    BodyId some(std::size_t k) const { return boxes[(k * 7919) % boxes.size()]; }
};

void noteStages(Table& table, const std::string& which, const StepReport& report, int steps) {
    const auto note = [&](const char* stage, double seconds) {
        table.note("step, " + which + ": " + stage, 1e6 * seconds / steps);
    };
    note("all", report.times.total);
    note("broad phase", report.times.broadPhase);
    note("narrow phase", report.times.narrowPhase);
    note("islands", report.times.islands);
    note("solve", report.times.solve);
    note("continuous", report.times.continuous);
}

void noteCalls(Table& table, const std::string& which, Columns& c) {
    constexpr std::size_t calls = 200;
    Worldd& world = c.world;
    const auto note = [&](const char* call, double us) { table.note(std::string(call) + ", " + which, us); };
    note("pose", timed(calls, [&](std::size_t k) { world.pose(c.some(k)); }));
    const WorldQuery query = world.query();
    note("rayCast", timed(calls, [&](std::size_t k) {
             query.rayCast({.origin = world.centre(c.some(k)) + Vec3d(0, 10, 0), .direction = -Vec3d::UnitY()});
         }));
    note("wake", timed(calls, [&](std::size_t k) { world.wake(c.some(k)); }));
    note("applyForce", timed(calls, [&](std::size_t k) { world.applyForce(c.some(k), Vec3d(0, 1e-3, 0)); }));
    note("applyImpulse", timed(calls, [&](std::size_t k) {
             world.applyImpulse(c.some(k), Vec3d(0, 1e-6, 0), world.centre(c.some(k)));
         }));
    note("setVelocity",
         timed(calls, [&](std::size_t k) { world.setVelocity(c.some(k), Vec3d::Zero(), Vec3d::Zero()); }));
    note("setPose", timed(calls, [&](std::size_t k) { world.setPose(c.some(k), world.pose(c.some(k))); }));
    std::vector<JointId> joints;
    note("addJoint", timed(calls, [&](std::size_t k) {
             joints.push_back(world.add(WeldDef{.a = c.floor, .b = c.some(k), .anchor = world.centre(c.some(k))}));
         }));
    note("remove a joint", timed(calls, [&](std::size_t k) { world.remove(joints[(k * 37) % calls]); }));
    world.step(dt);
    note("remove a body", timed(calls, [&](std::size_t k) { world.remove(c.some(k)); }));
    note("add a body", timed(calls, [&](std::size_t k) {
             c.boxes[(k * 7919) % c.boxes.size()] = world.add(boxAt({2.0 * double(k), 1000, 0}));
         }));
}

void noteViews(Table& table, const Columns& c) {
    const Worldd& world = c.world;
    table.note("contacts()", timed(1, [&](std::size_t) { world.contacts(); }));
    table.note("bodyErrors()", timed(1, [&](std::size_t) { world.bodyErrors(); }));
    table.note("bodies()", timed(1, [&](std::size_t) { world.bodies(); }));
}

void measure(Table& table, int n) {
    const auto count = static_cast<std::size_t>(n);
    {
        const double before = residentBytes();
        const auto start = std::chrono::steady_clock::now();
        Columns c(n, false);
        const std::chrono::duration<double, std::micro> built = std::chrono::steady_clock::now() - start;
        table.note("add, each of all", built.count() / n);
        noteStages(table, "the first", c.world.step(dt), 1);
        table.note("bytes a body", (residentBytes() - before) / n);
        constexpr int steps = 3;
        for (int k = 0; k < steps; ++k) {
            for (std::size_t i = 0; i < count; i += columnHeight) {  // so that no column is settled
                c.world.setVelocity(c.boxes[i], Vec3d(0.01, 0, 0), Vec3d::Zero());
            }
            noteStages(table, "moving", c.world.step(dt), steps);
        }
        noteViews(table, c);
        noteCalls(table, "awake", c);
        c.world.step(dt);
        const std::size_t all = c.boxes.size();
        table.note("remove, each of all",
                   timed(all - 10, [&](std::size_t k) { c.world.remove(c.boxes[all - 1 - k]); }));
        c.world.step(dt);
        noteStages(table, "ten bodies where n were", c.world.step(dt), 1);
        table.note("bodies(), ten bodies where n were", timed(1, [&](std::size_t) { c.world.bodies(); }));
    }
    Columns c(n, true);
    constexpr int longest = 300;  // steps until all sleep
    for (int k = 0; k < longest && c.world.step(dt).counts.awake > 0; ++k) {
    }
    c.world.step(dt);
    noteStages(table, "asleep", c.world.step(dt), 1);
    noteCalls(table, "asleep", c);
}

}  // namespace
}  // namespace cairn::bench

int main(int argc, char** argv) {
    std::vector<int> counts;
    for (int i = 1; i < argc; ++i) {
        counts.push_back(std::max(64, std::atoi(argv[i])));
    }
    if (counts.empty()) {
        counts = {1000, 4000, 16000, 100000};
    }
    cairn::bench::Table table(counts);
    for (std::size_t i = 0; i < counts.size(); ++i) {
        table.begin(i);
        cairn::bench::measure(table, counts[i]);
    }
    table.print();
}
