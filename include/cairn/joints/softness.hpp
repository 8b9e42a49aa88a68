#pragma once
#include <cairn/defs.hpp>

namespace cairn {

// How a joint gives way. Both zero: rigid. Give either compliance and damping, or frequency and damping ratio.
struct Softness {
    double compliance = 0;    // m/N or rad/(N m), inverse stiffness
    double damping = 0;       // N s/m or N m s/rad
    double frequency = 0;     // Hz, of the two bodies' effective mass on each row; > 0 overrides compliance and damping
    double dampingRatio = 1;  // of critical, used with frequency
};

}  // namespace cairn
