#pragma once
// FCL beside Cairn's own narrow phase, pair of kinds by pair of kinds: what an answer costs, how far it is off, and how
// often FCL's had to be replaced.
#include <cairn/narrow_phase.hpp>

#include <nlohmann/json.hpp>

#include <functional>
#include <string>
#include <vector>

namespace cairn {

struct NarrowPhaseEntry {
    double nanoseconds = 0;  // CPU of one thread, a pair
    double shallow = 0;      // m, of the depth or distance: apart within 2 cm, touching, or 1 cm deep
    double deep = 0;         // m, the same 2 to 20 cm deep
    double direction = 0;    // rad, where the shapes are apart: overlapping ones may be left in several
    double missed = 0;       // share of pairs within the margin, or overlapping, that got no answer
    double asked = 0;        // of FCL, a pair; a mesh's triangles are asked one by one
    double repaired = 0;     // share of those
};

struct NarrowPhasePair {
    std::string kinds;
    NarrowPhaseEntry own;
    NarrowPhaseEntry fcl;

    // Whether `auto` should ask FCL: it is asked, costs less by a tenth, and errs by no more.
    bool isBetterByFcl() const {
        return fcl.asked > 0 && fcl.nanoseconds < 0.9 * own.nanoseconds && fcl.shallow <= own.shallow &&
               fcl.deep <= own.deep;
    }
};

// poses: of each sort, against the exact answer.
std::vector<NarrowPhasePair> narrowPhaseStudy(int poses, const std::function<void(double)>& tell = {});

nlohmann::ordered_json toJson(const std::vector<NarrowPhasePair>& study);

}  // namespace cairn
