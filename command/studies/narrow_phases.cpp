#include "command/studies/narrow_phases.hpp"
#include "command/studies/exact_overlap.hpp"

#include <ctime>

namespace cairn {
namespace {

constexpr double margin = 0.02;  // m

struct ExactPose {
    truth::Sort sort = truth::Touching;
    Posed pose;
    truth::MinOverlap exact;
    bool isFlush = false;
};

double threadSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Whether a face of one is flush with the other: what is nearest beside it is taken for an internal edge, and culled.
bool isFlush(const Shape& a, const Shape& b, const Posed& pose) {
    constexpr double slack = 1e-3;  // m, as the narrow phase's
    std::vector<Vec3d> faces;
    std::vector<Vec3d> edges;
    truth::appendAxes(a, Quatd::Identity(), faces, edges);
    truth::appendAxes(b, pose.rotation, faces, edges);
    return std::any_of(faces.begin(), faces.end(), [&](const Vec3d& n) {
        return std::min(std::abs(truth::overlap(a, b, pose, n)), std::abs(truth::overlap(a, b, pose, -n))) <= slack;
    });
}

// What is within the margin for certain, and no internal edge.
bool mustAnswer(const ExactPose& at) {
    return at.exact.overlap > -margin + 1e-3 && std::abs(at.exact.overlap) > 2e-3 && !at.isFlush;
}

class Bench {
public:
    Bench(const Shape& a, const Shape& b, std::vector<ExactPose> poses)
        : a_(a), b_(b), poses_(std::move(poses)), caches_(poses_.size()) {}

    NarrowCounts ask(std::size_t i, NarrowPhase which) {
        NarrowCounts counts;
        found_.clear();
        collide({&a_, 1}, {&b_, 1}, poses_[i].pose, margin, caches_[i], found_, counts, which);
        return counts;
    }

    NarrowPhaseEntry errors(NarrowPhase which) {
        NarrowPhaseEntry entry;
        NarrowCounts counts;
        int near = 0;
        for (std::size_t i = 0; i < poses_.size(); ++i) {
            counts += ask(i, which);
            near += mustAnswer(poses_[i]) ? 1 : 0;
            if (found_.empty()) {
                entry.missed += mustAnswer(poses_[i]) ? 1 : 0;
            } else {
                compare(poses_[i], entry);
            }
        }
        entry.missed /= std::max(1, near);
        entry.asked = static_cast<double>(counts.throughFcl) / static_cast<double>(poses_.size());
        entry.repaired = static_cast<double>(counts.repairedFcl) /
                         static_cast<double>(std::max<std::uint64_t>(1, counts.throughFcl));
        return entry;
    }

    // One after the other in short rounds, so that what else the machine does slows both; the least of all rounds.
    void time(NarrowPhaseEntry& own, NarrowPhaseEntry& fcl) {
        own.nanoseconds = fcl.nanoseconds = 1e300;
        for (int round = 0; round < 40; ++round) {
            own.nanoseconds = std::min(own.nanoseconds, timeOf(NarrowPhase::Own));
            fcl.nanoseconds = std::min(fcl.nanoseconds, timeOf(NarrowPhase::Fcl));
        }
    }

private:
    double timeOf(NarrowPhase which) {
        constexpr int repeats = 4;
        const double start = threadSeconds();
        for (int k = 0; k < repeats; ++k) {
            for (std::size_t i = 0; i < poses_.size(); ++i) {
                ask(i, which);
            }
        }
        return 1e9 * (threadSeconds() - start) / (repeats * static_cast<double>(poses_.size()));
    }

    void compare(const ExactPose& at, NarrowPhaseEntry& entry) const {
        double depth = -1e300;
        Vec3d normal = Vec3d::UnitY();
        for (const Manifold& m : found_) {
            for (int k = 0; k < m.count; ++k) {
                const double deepest = m.deeper - m.points[static_cast<std::size_t>(k)].separation;
                if (deepest > depth) {
                    depth = deepest;
                    normal = m.normal;
                }
            }
        }
        double& worst = at.sort == truth::Deep ? entry.deep : entry.shallow;
        worst = std::max(worst, std::abs(depth - at.exact.overlap));
        if (at.exact.overlap < -1e-4) {
            entry.direction = std::max(entry.direction, std::acos(std::clamp(normal.dot(at.exact.normal), -1.0, 1.0)));
        }
    }

    const Shape& a_;
    const Shape& b_;
    std::vector<ExactPose> poses_;
    std::vector<PairCache> caches_;
    std::vector<Manifold> found_;
};

}  // namespace

std::vector<NarrowPhasePair> narrowPhaseStudy(int poses, const std::function<void(double)>& tell) {
    std::vector<NarrowPhasePair> study;
    const auto pairs = truth::pairs();
    for (const auto& [a, b] : pairs) {
        std::mt19937 random(static_cast<unsigned>(study.size()) + 1);
        std::vector<ExactPose> at;
        for (int i = 0; i < poses * truth::sorts; ++i) {
            const auto sort = static_cast<truth::Sort>(i % truth::sorts);
            const Posed pose = truth::poseOf(sort, a, b, random);
            at.push_back({sort, pose, truth::smallest(a, b, pose, 400), isConvex(a.kind) && isFlush(a, b, pose)});
        }
        Bench bench(a, b, std::move(at));
        NarrowPhasePair& pair = study.emplace_back();
        pair.kinds = std::string(name(a.kind)) + " - " + name(b.kind);
        pair.own = bench.errors(NarrowPhase::Own);
        pair.fcl = bench.errors(NarrowPhase::Fcl);
        bench.time(pair.own, pair.fcl);
        if (tell) {
            tell(static_cast<double>(study.size()) / static_cast<double>(pairs.size()));
        }
    }
    return study;
}

nlohmann::ordered_json toJson(const std::vector<NarrowPhasePair>& study) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["study"] = "narrow_phase";
    json["pairs"] = Json::array();
    const auto entry = [](const NarrowPhaseEntry& e) {
        return Json{{"ns", e.nanoseconds},          {"depth_error_shallow_m", e.shallow},
                    {"depth_error_deep_m", e.deep}, {"direction_error_rad", e.direction},
                    {"missed", e.missed},           {"asked_of_fcl", e.asked},
                    {"repaired", e.repaired}};
    };
    for (const NarrowPhasePair& pair : study) {
        json["pairs"].push_back({{"kinds", pair.kinds},
                                 {"own", entry(pair.own)},
                                 {"fcl", entry(pair.fcl)},
                                 {"better", pair.isBetterByFcl() ? "fcl" : "own"}});
    }
    return json;
}

}  // namespace cairn
