#include "command/studies/study.hpp"

#include <cmath>

namespace cairn {

StudyOutput studyNarrowPhase(bool full, const Tell& tell) {
    const std::vector<NarrowPhasePair> study = narrowPhaseStudy(full ? 100 : 20, tell);
    StudyOutput out;
    out.json = toJson(study);
    StudyTable result{.title = "Narrow phase: own, fcl",
                      .note =
                          "CPU time of one thread. Worst depth or distance off, apart to 1 cm deep and 2 to 20 cm "
                          "deep; worst angle of the normal where the shapes are apart; shapes of 0.2 to 0.5 m. "
                          "Repaired: of FCL's answers, replaced by our own.",
                      .rows = {{"pair", "ns", "shallow, mm", "deep, mm", "degrees", "repaired, %", "better<"}}};
    const auto both = [](double own, double fcl, int decimals) {
        return fixed(own, decimals) + ", " + fixed(fcl, decimals);
    };
    for (const NarrowPhasePair& pair : study) {
        const NarrowPhaseEntry& own = pair.own;
        const NarrowPhaseEntry& fcl = pair.fcl;
        result.rows.push_back(
            {pair.kinds, both(own.nanoseconds, fcl.nanoseconds, 0), both(1e3 * own.shallow, 1e3 * fcl.shallow, 2),
             both(1e3 * own.deep, 1e3 * fcl.deep, 2), both(own.direction * 180 / M_PI, fcl.direction * 180 / M_PI, 1),
             fcl.asked > 0 ? fixed(100 * fcl.repaired, 1) : "not asked", pair.isBetterByFcl() ? "fcl" : "own"});
        if (own.missed > 0 || fcl.missed > 0) {
            out.broken.push_back(pair.kinds + ": a pair within the margin got no answer");
        }
    }
    out.tables = {result};
    return out;
}

}  // namespace cairn
