#pragma once
// What is known of a scene's motion without any engine: closed forms, and the measures of SimBenchmark (leggedrobotics,
// 2018), by the names of built-in scenes.
#include <cairn/assets.hpp>

#include <functional>

namespace cairn {

// Where a point of a body is at a time, by formula.
struct TruePoint {
    std::size_t body;
    Vec3d onBody = Vec3d::Zero();                // m, body frame
    std::function<Vec3d(double seconds)> place;  // m, world
};

// The error measures of SimBenchmark's tests; means over steps.
enum class SimBenchmark {
    None,
    Rolling,   // |dv|^2 of the box plus that of the balls, their mean, against the analytic speeds; (m/s)^2
    Bouncing,  // (E - E0)^2; J^2
    Balls666,  // sum of squared penetrations; m^2
};

struct Known {
    bool rests = false;  // nothing in it should move
    std::vector<TruePoint> points;
    SimBenchmark simBenchmark = SimBenchmark::None;
    std::function<Vec3d(std::size_t body, double seconds)> velocity;  // m/s, for SimBenchmark::Rolling
};

// Of a scene that nothing is known of: nothing. Closed forms hold from the scene's start to its `seconds`.
Known knownOf(const Scene& scene);

}  // namespace cairn
