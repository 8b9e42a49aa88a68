#pragma once
// What steps cost, so that runs on a busy machine can be compared.
#include "demos/simulation.hpp"

namespace cairn {

// s of processor time of this process, all its threads together: what other programs take from the cores is not in it.
double cpuSeconds();

// x to three digits, for words.
std::string brief(double x);

// The scene, but that no clock chooses what is done.
Scene withoutBudget(Scene scene);

// Repeats of one measurement, of which the least counts: what disturbs only adds.
class Repeats {
public:
    void add(double seconds);
    double min() const { return min_; }
    // How far the second least was above the least: below this, differences mean nothing. 0 after one repeat.
    double noise() const { return second_ < unknown ? second_ - min_ : 0; }

private:
    static constexpr double unknown = 1e300;
    double min_ = unknown;
    double second_ = unknown;
};

}  // namespace cairn
