// Hashes of ten small scenes after three seconds: the same for any number of threads, and for every build that computes
// the same bits.
//   cairn_hashes             prints them, with one thread
//   cairn_hashes FILE        compares them with those in FILE, with 1, 2 and 4 threads
#include <cairn/cairn.hpp>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <string>

namespace cairn {
namespace {

constexpr int steps = 180;
constexpr double dt = 1.0 / 60;

// The same numbers everywhere: neither a library's engine nor its distributions have a say.
class Random {
public:
    double within(double low, double high) {
        state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
        return low + (high - low) * 0x1p-53 * static_cast<double>(state_ >> 11);
    }
    Vec3d vector(double size) {
        const double x = within(-size, size);
        const double y = within(-size, size);
        return {x, y, within(-size, size)};
    }
    Quatd rotation() {
        const Vec3d v = vector(1);
        return Quatd(within(0.1, 1), v.x(), v.y(), v.z()).normalized();
    }

private:
    std::uint64_t state_ = 1;
};

void addFloor(Worldd& world) {
    world.add({.type = BodyType::Static, .shapes = {box({20, 1, 20})}, .position = {0, -1, 0}});
}

BodyId addBox(Worldd& world, const Vec3d& half, const Vec3d& position, double mass = 1) {
    return world.add({.shapes = {box(half)}, .position = position, .mass = mass});
}

void tower(Worldd& world) {
    addFloor(world);
    for (int i = 0; i < 6; ++i) {
        addBox(world, Vec3d::Constant(0.5), Vec3d(0.03 * (i % 2), 0.5 + i, 0), i % 2 == 0 ? 1 : 20);
    }
}

void pyramid(Worldd& world) {
    addFloor(world);
    for (int row = 0; row < 5; ++row) {
        for (int i = 0; i < 5 - row; ++i) {
            addBox(world, Vec3d::Constant(0.5), Vec3d(1.05 * (i + 0.5 * row), 0.52 + 1.02 * row, 0));
        }
    }
}

void pile(Worldd& world) {
    addFloor(world);
    Random random;
    const std::array<Shape, 6> shapes = {box({0.3, 0.2, 0.25}), sphere(0.3),    capsule(0.15, 0.2),
                                         cylinder(0.25, 0.2),   cone(0.3, 0.3), ellipsoid({0.3, 0.2, 0.25})};
    for (std::size_t i = 0; i < 12; ++i) {
        const Vec3d place = random.vector(0.4) + Vec3d(0, 1 + 0.6 * static_cast<double>(i), 0);
        world.add({.shapes = {shapes[i % shapes.size()]}, .position = place, .rotation = random.rotation(), .mass = 1});
    }
}

void chain(Worldd& world) {
    BodyId last = world.add({.type = BodyType::Static, .shapes = {sphere(0.1)}, .position = {0, 10, 0}});
    for (int i = 0; i < 10; ++i) {
        const Vec3d place(0.5 + i, 10, 0);
        const BodyId link = addBox(world, {0.4, 0.1, 0.1}, place, i == 9 ? 1000 : 1);
        world.add(BallDef{.a = last, .b = link, .anchor = place - Vec3d(0.5, 0, 0)});
        last = link;
    }
}

void joints(Worldd& world) {
    addFloor(world);
    const BodyId trunk = addBox(world, {0.2, 0.4, 0.15}, {0, 2, 0}, 10);
    for (const double side : {-1.0, 1.0}) {
        const BodyId upper = world.add({.shapes = {capsule(0.08, 0.2)}, .position = {0.35 * side, 2.1, 0}, .mass = 2});
        world.add(ConeTwistDef{.a = trunk, .b = upper, .anchor = {0.25 * side, 2.3, 0}, .axis = {side, 0, 0}});
        const BodyId lower = world.add({.shapes = {capsule(0.06, 0.2)}, .position = {0.35 * side, 1.6, 0}, .mass = 1});
        world.add(HingeDef{.a = upper,
                           .b = lower,
                           .anchor = {0.35 * side, 1.85, 0},
                           .axis = {1, 0, 0},
                           .lower = -2,
                           .upper = 0.1,
                           .motorSpeed = 1,
                           .motorTorque = 0.5});
    }
    const BodyId cart = addBox(world, Vec3d::Constant(0.2), {2, 1, 0});
    world.add(SliderDef{.a = trunk, .b = cart, .axis = {1, 0.2, 0}, .lower = -1, .upper = 1});
}

void bounce(Worldd& world) {
    addFloor(world);
    for (int i = 0; i < 5; ++i) {
        Shape ball = i % 2 == 0 ? sphere(0.3) : box({0.3, 0.2, 0.25});
        ball.material.restitution = 0.8;
        ball.material.rollingFriction = 0.01;
        world.add({.shapes = {ball},
                   .position = {i * 1.0, 2.0 + i, 0},
                   .linearVelocity = {1, 0, 0.3 * i},
                   .angularVelocity = {3, 1, 2.0 * i},
                   .mass = 1});
    }
}

void terrain(Worldd& world) {
    constexpr int side = 12;
    TriangleMesh grid;
    for (int i = 0; i <= side; ++i) {
        for (int j = 0; j <= side; ++j) {
            const double x = i - 0.5 * side;
            const double z = j - 0.5 * side;
            grid.vertices.emplace_back(x, 0.04 * (x * x + z * z) + 0.1 * ((i * 7 + j * 3) % 5), z);
        }
    }
    for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
            const int v = i * (side + 1) + j;
            grid.triangles.push_back({v, v + 1, v + side + 1});
            grid.triangles.push_back({v + 1, v + side + 2, v + side + 1});
        }
    }
    world.add({.type = BodyType::Static, .shapes = {mesh(grid)}});
    Random random;
    const Shape rock = hull({{0.4, -0.3, 0}, {-0.3, -0.3, 0.4}, {-0.3, -0.3, -0.4}, {0, 0.4, 0}},
                            {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}});
    for (int i = 0; i < 8; ++i) {
        const Vec3d place = random.vector(2) + Vec3d(0, 4 + i, 0);
        world.add({.shapes = {rock}, .position = place, .rotation = random.rotation(), .mass = 1});
    }
}

void tops(Worldd& world) {
    addFloor(world);
    world.add({.shapes = {box({0.5, 0.1, 0.3})}, .position = {5, 9, 0}, .angularVelocity = {0.1, 0.2, 12}, .mass = 1});
    for (int i = 0; i < 3; ++i) {
        world.add({.shapes = {cylinder(0.4, 0.05), capsule(0.05, 0.3)},
                   .position = {2.0 * i, 0.4, 0},
                   .rotation = Quatd(1, 0.05, 0, 0.02 * i).normalized(),
                   .angularVelocity = {0, 60, 0},
                   .mass = 1});
    }
}

void soft(Worldd& world) {
    addFloor(world);
    world.add({.type = BodyType::Static, .shapes = {sphere(0.5)}, .position = {0, 1, 0}});
    addDeformable(world, RopeDef{.from = {-1, 2, 0}, .to = {1, 2.2, 0.1}, .segments = 10, .damping = 0.01});
    addDeformable(world, ClothDef{.mesh = clothGrid({2, 1.5, -0.5}, {1, 0, 0}, {0, 0, 1}, 4, 4), .mass = 0.2});
    addBox(world, Vec3d::Constant(0.2), {2.5, 0.2, 0});
}

void shot(Worldd& world) {
    addFloor(world);
    for (int i = 0; i < 12; ++i) {
        const int row = i / 3;
        addBox(world, {0.25, 0.25, 0.5}, Vec3d(0, 0.25 + 0.5 * row, i % 3 - 1.0));
    }
    world.add({.shapes = {sphere(0.2)}, .position = {-20, 1, 0.1}, .linearVelocity = {90, 1, 0}, .mass = 5});
}

struct Trial {
    const char* name;
    void (*fill)(Worldd&);
    const char* solver;
};

// As many solvers as there are scenes for them.
constexpr std::array trials = {
    Trial{"tower", tower, "auto"},        Trial{"pyramid", pyramid, "gauss_seidel"},
    Trial{"pile", pile, "auto"},          Trial{"chain", chain, "direct"},
    Trial{"joints", joints, "hybrid"},    Trial{"bounce", bounce, "nncg"},
    Trial{"terrain", terrain, "cluster"}, Trial{"tops", tops, "jacobi"},
    Trial{"soft", soft, "xpbd"},          Trial{"shot", shot, "avbd"},
};

// FNV-1a over the bits of every pose and velocity.
std::uint64_t hashOf(const Worldd& world) {
    std::uint64_t hash = 14695981039346656037ull;
    const auto feed = [&](const auto& vector) {
        for (Eigen::Index k = 0; k < vector.size(); ++k) {
            std::uint64_t bits = 0;
            std::memcpy(&bits, &vector[k], sizeof bits);
            for (int shift = 0; shift < 64; shift += 8) {
                hash = (hash ^ (bits >> shift & 0xff)) * 1099511628211ull;
            }
        }
    };
    for (const BodyId id : world.bodies()) {
        const Posed pose = world.pose(id);
        feed(pose.position);
        feed(pose.rotation.coeffs());
        feed(world.linearVelocity(id));
        feed(world.angularVelocity(id));
    }
    return hash;
}

std::string hashAfter(const Trial& trial, int threads) {
    Worldd world({.solver = solverNamed(trial.solver), .threads = threads});
    trial.fill(world);
    for (int k = 0; k < steps; ++k) {
        world.step(dt);
    }
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hashOf(world)));
    return text;
}

int compare(const char* file) {
    std::ifstream stream(file);
    std::map<std::string, std::string> recorded;
    for (std::string name, hash; stream >> name >> hash;) {
        recorded[name] = hash;
    }
    int differ = 0;
    for (const Trial& trial : trials) {
        for (const int threads : {1, 2, 4}) {
            const std::string hash = hashAfter(trial, threads);
            if (hash != recorded[trial.name]) {
                std::printf("%s with %d threads: %s, recorded is %s\n", trial.name, threads, hash.c_str(),
                            recorded[trial.name].c_str());
                ++differ;
            }
        }
    }
    std::printf("%d of %zu differ\n", differ, 3 * trials.size());
    return differ == 0 ? 0 : 1;
}

}  // namespace
}  // namespace cairn

int main(int argc, char** argv) {
    if (argc > 1) {
        return cairn::compare(argv[1]);
    }
    for (const cairn::Trial& trial : cairn::trials) {
        std::printf("%s %s\n", trial.name, cairn::hashAfter(trial, 1).c_str());
    }
}
