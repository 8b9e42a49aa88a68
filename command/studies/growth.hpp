#pragma once
// How the cost of a step grows: with bodies, contact points, joints, and with the share of a world that is awake.
#include "demos/demos.hpp"

#include <array>
#include <functional>

namespace cairn {

using Tell = std::function<void(double)>;  // of the share that is done

struct GrowthSeries {
    std::string quantity = {};  // what grows: bodies, contact points, joints, share awake
    std::string solver = {};
    std::vector<std::array<double, 2>> points = {};  // of the quantity; ms a step, mean, of the thread's own work

    // p of ms ~ quantity^p: the slope of the straight line that is nearest in both logarithms.
    double exponent() const;
};

// Boxes on the floor, apart, of which a share slides and the others sleep.
Scene partlyAwake(int boxes, double shareAwake);

struct GrowthStudy {
    std::vector<GrowthSeries> series = {};  // by quantity, then by solver
};
// full: worlds of up to 8000 bodies instead of 2000.
GrowthStudy growthStudy(bool full, const Tell& tell = {});

nlohmann::ordered_json toJson(const GrowthStudy& study);

}  // namespace cairn
