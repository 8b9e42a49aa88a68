#include <cairn/report.hpp>

#include <cstdio>

namespace cairn {

std::vector<std::string> flagNames(std::uint32_t flags) {
    std::vector<std::string> names;
    if (flags & FlagNonFinite) {
        names.push_back("non_finite");
    }
    if (flags & FlagUnconverged) {
        names.push_back("unconverged");
    }
    if (flags & FlagRepaired) {
        names.push_back("repaired");
    }
    if (flags & FlagRefused) {
        names.push_back("refused");
    }
    if (flags & FlagTolerance) {
        names.push_back("tolerance");
    }
    if (flags & FlagEnergy) {
        names.push_back("energy");
    }
    return names;
}

const char* name(PlanReason reason) {
    switch (reason) {
        case PlanReason::Asked:
            return "as asked";
        case PlanReason::Exact:
            return "exactly: its factor is within the bound on work";
        case PlanReason::TooLarge:
            return "by sweeps: a factor would cost more than the bound on work";
        case PlanReason::TooDear:
            return "by sweeps: exact solutions take more than this step may take";
        case PlanReason::InMotion:
            return "by sweeps: of joints that move like these an exact solution is no nearer the truth";
        case PlanReason::Crowded:
            return "by sweeps: bodies deep in each other by the dozen pass through each other until they have parted";
        case PlanReason::BackingOff:
            return "by sweeps: an exact solution was not found a few steps ago";
        case PlanReason::Standing:
            return "not yet: it is left standing until its exact solution, which takes several steps, is there";
    }
    return "";
}

std::string StepReport::summary() const {
    if (flags & FlagRefused) {
        return "step refused: dt must be a finite number of seconds in (0, 1], and the world not moved from";
    }
    char text[400];
    std::snprintf(
        text, sizeof text,
        "%d bodies (%d awake), %d contacts, %d joints, %d islands; penetration %.4g mm, joint gap %.4g mm; %.3f ms",
        counts.bodies, counts.awake, counts.contacts, counts.joints, counts.islands, 1e3 * error.maxPenetration,
        1e3 * error.maxJointGap, 1e3 * times.total);
    std::string line = text;
    if (flags & FlagNonFinite) {
        line += "; " + std::to_string(nonFinite.size()) + " bodies went non-finite and were put back at rest";
    }
    if (flags & FlagUnconverged) {
        line += "; " + std::to_string(counts.unconverged) + " islands above tolerance";
    }
    if (counts.truncated > 0) {
        line += "; " + std::to_string(counts.truncated) + " islands truncated by what a step may take";
    }
    if (flags & FlagTolerance) {
        char over[100];
        double worst = 0;
        for (const IslandReport& island : islands) {
            worst = std::max(worst, island.overTolerance);
        }
        std::snprintf(over, sizeof over, "; an error is %.3g times what was asked", worst);
        line += over;
    }
    if (flags & FlagEnergy) {
        line += counts.energetic > 0 ? "; " + std::to_string(counts.energetic) + " islands gained energy from nothing"
                                     : "; over 1 % of the energy in play came from nothing in the last seconds";
    }
    if (flags & FlagRepaired) {
        line += "; " + std::to_string(counts.narrow.repairedFailures) + " narrow-phase answers repaired";
    }
    return line;
}

}  // namespace cairn
