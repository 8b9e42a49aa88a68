// Every pair of kinds, against a search over directions that shares nothing with the narrow phase, in poses that touch,
// lie within the margin, overlap a little, overlap deeply, and stand square to each other.
// Pairs are asked twice, of our own narrow phase and of FCL's.
// CAIRN_PAIR_POSES=N: N random poses a pair where any answer must be sound (100,000 takes 15 s; 3,000 unless told).
// CAIRN_PAIR_TRUTH=N: N poses of each sort against the search (8 unless told), CAIRN_PAIR_TABLE=FILE: what was worst.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>
#include <ctime>

#include <cstdlib>
#include <fstream>

namespace cairn {
namespace {

using namespace truth;

constexpr double margin = 0.02;

int countFrom(const char* variable, int standard) {
    const char* text = std::getenv(variable);
    return text != nullptr ? std::max(1, std::atoi(text)) : standard;
}

struct Worst {
    double excess = 0;  // m, overlap along the answered normal beyond the least
    double excessPart = 0;
    double depth = 0;  // m, deepest point against the overlap along the normal
    double angle = 0;  // rad, of the normal where the shapes are apart
    double points = 0;
    int asked = 0;
};

double threadSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

constexpr std::size_t pairCount = 49;

// Pairs as our own narrow phase answers them, then the same by FCL's.
NarrowPhase phaseOf(std::size_t i) {
    return i < pairCount ? NarrowPhase::Auto : NarrowPhase::Fcl;
}

std::string pairName(std::size_t i) {
    const auto [a, b] = pairs()[i % pairCount];
    return std::string(name(a.kind)) + "_" + name(b.kind) + (i < pairCount ? "" : "_by_fcl");
}

void expectSound(const std::vector<Manifold>& found) {
    for (const Manifold& m : found) {
        ASSERT_TRUE(m.count >= 1 && m.count <= 4);
        ASSERT_NEAR(m.normal.norm(), 1, 1e-9);
        for (int k = 0; k < m.count; ++k) {
            const ContactPoint& p = m.points[static_cast<std::size_t>(k)];
            ASSERT_TRUE(p.onA.allFinite() && p.onB.allFinite() && std::isfinite(p.separation));
            ASSERT_LE(p.separation, margin);
        }
    }
}

bool hasFlatSides(const Shape& s) {
    return s.kind == ShapeKind::Box || s.kind == ShapeKind::Hull || s.kind == ShapeKind::Cylinder;
}

class EveryPair : public testing::TestWithParam<std::size_t> {};

TEST_P(EveryPair, AgreesWithASearchOverDirections) {
    const auto [a, b] = pairs()[GetParam() % pairCount];
    std::mt19937 random(static_cast<unsigned>(GetParam() % pairCount) + 1);
    const NarrowPhase which = phaseOf(GetParam());
    const int count = countFrom("CAIRN_PAIR_TRUTH", 8);
    std::array<Worst, sorts> worst;
    for (int s = 0; s < sorts; ++s) {
        const auto sort = static_cast<Sort>(s);
        Worst& w = worst[static_cast<std::size_t>(s)];
        for (int i = 0; i < count; ++i) {
            const bool swap = i % 2 == 1;
            const Posed pose = poseOf(sort, a, b, random);
            const MinOverlap truth = smallest(a, b, pose, 400);
            SCOPED_TRACE(std::string(sortNames[static_cast<std::size_t>(s)]) + " " + std::to_string(i) + ", overlap " +
                         std::to_string(truth.overlap));
            PairCache cache;
            NarrowCounts counts;
            const auto found = swap ? truth::ask(b, a, pose.inverse(), margin, cache, counts, which)
                                    : truth::ask(a, b, pose, margin, cache, counts, which);
            expectSound(found);
            if (found.empty()) {
                // Between flat sides, a strip of under a millimetre is culled as an internal edge.
                EXPECT_LT(truth.overlap, hasFlatSides(a) && hasFlatSides(b) ? 1e-3 : -margin + 2e-4);
                continue;
            }
            ASSERT_EQ(found.size(), 1u);
            const Manifold& m = found[0];
            const Vec3d n = swap ? Vec3d(-(pose.rotation * m.normal)) : m.normal;
            const double along = overlapAlong(a, b, pose, n);
            if (isConvex(a.kind) && isConvex(b.kind)) {
                EXPECT_NEAR(projectedOverlap(a, b, pose, n), along, 1e-9);
            }
            double deepest = 1;
            for (int k = 0; k < m.count; ++k) {
                const ContactPoint& p = m.points[static_cast<std::size_t>(k)];
                const Vec3d gap = swap ? Vec3d(p.onA - pose.inverse() * p.onB) : Vec3d(pose * p.onB - p.onA);
                EXPECT_NEAR((swap ? Vec3d(-(pose.rotation * gap)) : gap).dot(n) * (swap ? -1 : 1), p.separation, 1e-9);
                deepest = std::min(deepest, p.separation);
            }
            ++w.asked;
            w.points += m.count;
            w.excess = std::max(w.excess, along - truth.overlap);
            w.excessPart = std::max(w.excessPart, (along - truth.overlap) / std::max(std::abs(truth.overlap), 0.01));
            w.depth = std::max(w.depth, std::abs(deepest + along));
            if (truth.overlap < -1e-4) {
                w.angle = std::max(w.angle, std::acos(std::min(1.0, n.dot(truth.normal))));
            }
            // Faces are preferred by 0.1 % of the thinner shape and 1 % of the depth; by some degrees where an edge
            // lies on one.
            const double allowed = 1e-3 + 0.02 * std::abs(truth.overlap);
            if (along < truth.overlap + allowed) {
                EXPECT_NEAR(deepest, -along, 1e-3 + 0.06 * std::max(0.0, along));
            } else {
                EXPECT_GT(m.count, 1);
                EXPECT_NEAR(-deepest, truth.overlap, allowed + 0.06 * std::max(0.0, truth.overlap));
                EXPECT_LT(truth::overlapAfter(a, b, pose, std::max(0.0, -deepest) * n), allowed);
            }
        }
    }
    if (const char* file = std::getenv("CAIRN_PAIR_TABLE")) {
        // Warm caches at poses of every sort, as in a running world.
        std::vector<Posed> poses;
        for (int i = 0; i < 60; ++i) {
            poses.push_back(poseOf(static_cast<Sort>(1 + i % 4), a, b, random));
        }
        std::vector<PairCache> caches(poses.size());
        NarrowCounts counts;
        std::vector<Manifold> out;
        double smallest = 1e300;
        for (int round = 0; round < 200; ++round) {
            const double start = threadSeconds();
            for (std::size_t i = 0; i < poses.size(); ++i) {
                out.clear();
                collide({&a, 1}, {&b, 1}, poses[i], margin, caches[i], out, counts, which);
            }
            smallest = std::min(smallest, threadSeconds() - start);
        }
        std::ofstream table(file, std::ios::app);
        table << pairName(GetParam()) << " ns " << std::lround(smallest / 60 * 1e9);
        for (int s = 0; s < sorts; ++s) {
            const Worst& w = worst[static_cast<std::size_t>(s)];
            char text[160];
            std::snprintf(text, sizeof text, " | %s excess %.2f mm (%.1f%%) depth %.2f mm angle %.1f points %.1f",
                          sortNames[static_cast<std::size_t>(s)], 1e3 * w.excess, 100 * w.excessPart, 1e3 * w.depth,
                          w.angle * 180 / M_PI, w.points / std::max(1, w.asked));
            table << text;
        }
        table << "\n";
    }
}

// Whether they overlap for certain, and by more than the slack of an internal edge: a point of one is inside the other.
bool surelyOverlap(const Shape& a, const Shape& b, const Posed& pose) {
    if (!isConvex(a.kind)) {
        // Triangles are passed from behind, which a shape's centre tells: a cone's is below its middle.
        const Vec3d centre(0, b.kind == ShapeKind::Cone ? -0.5 * b.size.y() : 0, 0);
        return planeOverlap(b, pose) > 1e-6 && (pose * centre).y() > 0.01;
    }
    const Posed back = pose.inverse();
    if (truth::level(a, pose.position) < -2e-3 || truth::level(b, back.position) < -2e-3) {
        return true;
    }
    for (int i = 0; i < 26; ++i) {
        const int k = i < 13 ? i : i + 1;  // without the middle
        const int row = k / 3 % 3 - 1;
        const int layer = k / 9 - 1;
        const Vec3d d(k % 3 - 1 + 1e-3, row + 2e-3, layer + 3e-3);
        if (truth::level(a, pose * truth::support(b, d)) < -2e-3 ||
            truth::level(b, back * truth::support(a, d)) < -2e-3) {
            return true;
        }
    }
    return false;
}

TEST_P(EveryPair, AnswersAnyPose) {
    const auto [a, b] = pairs()[GetParam() % pairCount];
    std::mt19937 random(static_cast<unsigned>(GetParam() % pairCount) + 1000);
    const int count = countFrom("CAIRN_PAIR_POSES", 3000);
    NarrowCounts counts;
    int overlapping = 0;
    for (int i = 0; i < count; ++i) {
        PairCache cache;
        Posed pose;
        pose.rotation = i % 5 == 0 ? squareTurn(random) : truth::randomTurn(random);
        pose.position = std::uniform_real_distribution<double>(0, 0.9)(random) * truth::randomDirection(random);
        if (!isConvex(a.kind)) {
            pose.position.y() = std::abs(pose.position.y());
        }
        const bool swap = i % 2 == 1;
        const auto found = swap ? truth::ask(b, a, pose.inverse(), margin, cache, counts, phaseOf(GetParam()))
                                : truth::ask(a, b, pose, margin, cache, counts, phaseOf(GetParam()));
        expectSound(found);
        if (surelyOverlap(a, b, pose)) {
            ++overlapping;
            ASSERT_FALSE(found.empty()) << i;
        }
    }
    EXPECT_GT(overlapping, count / 20);
    RecordProperty("overlapping", overlapping);
    RecordProperty("repaired_normals", static_cast<int>(counts.repairedNormals));
    RecordProperty("repaired_failures", static_cast<int>(counts.repairedFailures));
    RecordProperty("repaired_fcl", static_cast<int>(counts.repairedFcl));
}

TEST_P(EveryPair, IsAsFarApartAsAnswered) {
    const auto [a, b] = pairs()[GetParam() % pairCount];
    const bool isSolid = isConvex(a.kind) && isConvex(b.kind);
    std::mt19937 random(static_cast<unsigned>(GetParam() % pairCount) + 2000);
    int apart = 0;
    int told = 0;
    for (int i = 0; i < 400; ++i) {
        const Posed pose{std::uniform_real_distribution<double>(0, 1.5)(random) * truth::randomDirection(random),
                         i % 5 == 0 ? squareTurn(random) : truth::randomTurn(random)};
        PairCache cache;
        NarrowCounts counts;
        std::vector<Manifold> found;
        const double least = collide({&a, 1}, {&b, 1}, pose, margin, cache, found, counts, phaseOf(GetParam()));
        if (!isSolid && a.kind != ShapeKind::HalfSpace) {
            ASSERT_EQ(least, 0) << "of surfaces nothing is told";
            continue;
        }
        const double distance = closestPoints({&a, 1}, Posed(), {&b, 1}, pose)->distance;
        ASSERT_LE(least, std::max(0.0, distance) + 1e-9) << i;
        ASSERT_TRUE(found.empty() || least == 0) << i;
        apart += distance > 2 * margin ? 1 : 0;
        told += distance > 2 * margin && least > margin ? 1 : 0;
    }
    EXPECT_GT(apart, isSolid ? 20 : -1);
    if (phaseOf(GetParam()) == NarrowPhase::Auto) {
        EXPECT_EQ(told, apart);
    }
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryPair, testing::Range<std::size_t>(0, 2 * pairCount),
                         [](const auto& each) { return pairName(each.param); });

}  // namespace
}  // namespace cairn
