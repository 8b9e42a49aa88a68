#include <cairn/diagnosis.hpp>

#include "engine/analysis/forecast.hpp"
#include "engine/model/describe.hpp"
#include "engine/solve/auto.hpp"
#include "engine/solve/newton/direct.hpp"
#include "engine/world/world_impl.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include <cstdarg>
#include <cstdio>
#include <numbers>
#include <set>

namespace cairn {
namespace {

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
std::string
format(const char* pattern, ...) {
    std::va_list values;
    va_start(values, pattern);
    char text[600];
    std::vsnprintf(text, sizeof text, pattern, values);
    va_end(values);
    return text;
}

// What counts as hard.
constexpr double heavy = 10;           // mass ratio of neighbours, where sweeps feel it already
constexpr double veryHeavy = 100;      // and where they will, once there is a load
constexpr double fewSweeps = 20;       // anyone gives these a step
constexpr double manySweeps = 100;     // of a plain sweep; nobody gives more a step
constexpr double phase = 0.6;          // rad a sub-step, of a spring: ten steps a period
constexpr double deep = 0.001;         // m
constexpr double flat = 1e-3;          // least over greatest moment of inertia
constexpr double largeBody = 50;       // m
constexpr double lightest = 0.5;       // kg/m3: half of air; crates of 1 kg in 1 m3 are common, and harmless
constexpr double densest = 23000;      // kg/m3: denser than osmium
constexpr double strongGravity = 50;   // m/s2
constexpr Eigen::Index maxRows = 600;  // of joints, for which redundancy is looked for
constexpr double dependent = 1e-8;     // pivot over the first one, below which a row says nothing new

template <class S>
class Doctor {
public:
    Doctor(const WorldDef& def, const BodyTable<S>& bodies, S dt, double position)
        : def_(def), bodies_(bodies), dt_(static_cast<double>(dt)), position_(position) {}

    void lookAtWorld() {
        if (const double g = def_.gravity.norm(); g > strongGravity) {
            add(FindingKind::Units, {}, g,
                format("Gravity is %.4g m/s2, %.3g times the earth's: if lengths are in centimetres, divide them, "
                       "gravity too, by 100.",
                       g, g / 9.81));
        }
        bodies_.forEach([&](std::size_t i) {
            if (bodies_[i].isDynamic()) {
                lookAtBody(static_cast<std::uint32_t>(i));
            }
        });
    }

    void lookAtIsland(Problem<S>& problem, const IslandForecast& forecast) {
        lookAtMasses(problem, forecast);
        lookAtSprings(problem);
        lookAtOverlaps(problem);
        lookAtRedundancy(problem);
    }

    std::vector<Finding> findings() {
        std::stable_sort(findings_.begin(), findings_.end(), [](const Finding& a, const Finding& b) {
            return static_cast<int>(a.kind) < static_cast<int>(b.kind);
        });
        return std::move(findings_);
    }

private:
    void add(FindingKind kind, const std::vector<std::uint32_t>& who, double figure, std::string text) {
        Finding finding{.kind = kind, .text = std::move(text), .bodies = {}, .figure = figure};
        for (const std::uint32_t body : who) {
            finding.bodies.push_back(bodies_.idAt(body));
        }
        findings_.push_back(std::move(finding));
    }
    std::string nameOf(std::uint32_t body) const {
        const std::string& name = bodies_[body].name();
        return name.empty() ? "body " + std::to_string(body) : "\"" + name + "\"";
    }
    double substep() const { return dt_ / std::max(1, numbersOf(def_.solver).substeps); }

    void lookAtBody(std::uint32_t index) {
        const Body<S>& body = bodies_[index];
        const std::string who = nameOf(index);
        double thickness = std::numeric_limits<double>::infinity();  // m, half
        for (const Shape& shape : body.kind->def.shapes) {
            thickness = std::min(thickness, innerRadius(shape));
        }
        const double displacement = dt_ * static_cast<double>(body.v.norm());
        if (!body.kind->def.shapes.empty() && displacement > 2 * thickness) {
            add(FindingKind::FastBody, {index}, displacement / (2 * thickness),
                format(
                    "%s moves %.3g m in a step and is %.3g m thick: leave its continuous collision on, or take steps "
                    "of %.2g s.",
                    who.c_str(), displacement, 2 * thickness, dt_ * 2 * thickness / displacement));
        }
        if (!body.kind->def.shapes.empty() && 2 * body.kind->radius > largeBody) {
            add(FindingKind::Units, {index}, 2 * body.kind->radius,
                format("%s is %.4g m across: if its lengths are in centimetres, divide them by 100.", who.c_str(),
                       2 * body.kind->radius));
        }
        if (!body.kind->def.shapes.empty() && !body.kind->def.particle && 2 * body.kind->radius < def_.contactMargin) {
            add(FindingKind::Units, {index}, 2 * body.kind->radius,
                format("%s is %.3g mm across, less than the contact margin of %.3g mm: lower contactMargin to about a "
                       "tenth of it.",
                       who.c_str(), 2e3 * body.kind->radius, 1e3 * def_.contactMargin));
        }
        if (const double volume = volumeOf(body.kind->def); volume > 0) {
            const double density = static_cast<double>(body.kind->mass) / volume;
            if (density < lightest || density > densest) {
                add(FindingKind::Units, {index}, density,
                    format("%s weighs %.4g kg in %.3g m3, %.3g kg/m3: wood has 700, steel 7800; check its mass and its "
                           "size.",
                           who.c_str(), static_cast<double>(body.kind->mass), volume, density));
            }
        }
        if (!body.kind->def.particle) {
            const Vec3d moments =
                Eigen::SelfAdjointEigenSolver<Mat3d>(body.kind->inertia.template cast<double>()).eigenvalues();
            if (moments[0] < flat * moments[2]) {
                add(FindingKind::FlatInertia, {index}, moments[2] / moments[0],
                    format("The moments of inertia of %s are as 1 to %.3g: what pushes it off its long axis spins it "
                           "fast; make it thicker, or give an inertia of at least %.2g kg m2 about that axis.",
                           who.c_str(), moments[2] / moments[0], 1e-2 * moments[2]));
            }
        }
    }
    static double volumeOf(const BodyDef& def) {
        std::vector<Shape> shapes = def.shapes;
        for (Shape& shape : shapes) {
            shape.material.density = 1;
        }
        return shapes.empty() ? 0 : massProperties(shapes).mass;
    }

    // The worst neighbours, and what the island as a whole asks of sweeps.
    void lookAtMasses(const Problem<S>& problem, const IslandForecast& forecast) {
        double worst = 0;
        bool joined = false;
        std::uint32_t light = 0;
        std::uint32_t load = 0;
        const auto ask = [&](int a, int b, bool isJoint) {
            const SolverBody<S>& one = problem.bodies[static_cast<std::size_t>(a)];
            const SolverBody<S>& other = problem.bodies[static_cast<std::size_t>(b)];
            if (one.fixed || other.fixed) {
                return;
            }
            const SolverBody<S>& heavier = one.mass > other.mass ? one : other;
            const SolverBody<S>& lighter = one.mass > other.mass ? other : one;
            const double above =
                -def_.gravity.dot((heavier.pose.position - lighter.pose.position).template cast<double>());
            const double ratio = static_cast<double>(heavier.mass / lighter.mass);
            if (ratio > worst && (isJoint || above > 0)) {
                worst = ratio;
                joined = isJoint;
                light = lighter.index;
                load = heavier.index;
            }
        };
        for (const ProblemContact<S>& contact : problem.contacts) {
            ask(contact.a, contact.b, false);
        }
        for (const auto& link : problem.joints) {
            ask(link.a, link.b, true);
        }
        const bool slack = forecast.sweeps <= fewSweeps;
        const std::string sweeps =
            slack ? "little load goes through it in the next step; once it does, plain sweeps converge slowly"
                  : format("for %.3g mm, plain sweeps would need about %.0f a step, conjugate ones (nncg) %s",
                           1e3 * position_, std::ceil(forecast.sweeps),
                           std::isfinite(forecast.conjugateSweeps)
                               ? format("%.0f", std::ceil(forecast.conjugateSweeps)).c_str()
                               : "over a thousand");
        if (worst >= veryHeavy || (worst >= heavy && !slack)) {
            add(FindingKind::MassRatio, {load, light}, worst,
                format("%s (%.4g kg) %s %s (%.4g kg), %.4g to 1: %s; %s.", nameOf(load).c_str(),
                       static_cast<double>(bodies_[load].kind->mass), joined ? "is joined to" : "bears on",
                       nameOf(light).c_str(), static_cast<double>(bodies_[light].kind->mass), worst, sweeps.c_str(),
                       remedy(forecast).c_str()));
        } else if (forecast.sweeps > manySweeps && !forecast.exact) {
            add(FindingKind::SlowSweeps, {forecast.lowest.index}, forecast.sweeps,
                format("The island of %d bodies and %d rows about %s: %s; %s.", forecast.bodies, forecast.rows,
                       nameOf(forecast.lowest.index).c_str(), sweeps.c_str(), remedy(forecast).c_str()));
        }
    }
    std::string remedy(const IslandForecast& forecast) const {
        if (forecast.exact) {
            return solverName(def_.solver) + " solves this exactly, nothing needs to be done";
        }
        if (std::holds_alternative<AutoDef>(def_.solver)) {
            return format(
                "auto sweeps an island of this size too: a directWork of the solver above %.2g has it solved "
                "exactly, at that price",
                forecast.directWork);
        }
        return "use the solver auto, which solves this exactly where it can";
    }

    // One sentence an island, about the worst: what is woven of springs has thousands alike.
    void lookAtSprings(const Problem<S>& problem) {
        double worst = 0;  // rad/s
        std::size_t at = 0;
        int fast = 0;
        for (std::size_t k = 0; k < problem.joints.size(); ++k) {
            const RowBlock<S>& block = problem.blocks[k];
            double quickest = 0;
            for (int r = block.first; r < block.first + block.count; ++r) {
                const Row<S>& row = problem.rows[static_cast<std::size_t>(r)];
                if (row.compliance > S(0)) {
                    const S delassus = problem.responses[static_cast<std::size_t>(r)].delassus;
                    quickest = std::max(quickest, std::sqrt(static_cast<double>(delassus / row.compliance)));
                }
            }
            fast += quickest * substep() > phase ? 1 : 0;
            if (quickest > worst) {
                worst = quickest;
                at = k;
            }
        }
        if (fast == 0) {
            return;
        }
        const auto& link = problem.joints[at];
        const std::uint32_t a = problem.bodies[static_cast<std::size_t>(link.a)].index;
        const std::uint32_t b = problem.bodies[static_cast<std::size_t>(link.b)].index;
        const double cycles = worst / (2 * std::numbers::pi);
        add(FindingKind::StiffSpring, {a, b}, worst * substep() / (2 * std::numbers::pi),
            format(
                "%s between %s and %s%s swings %.3g times a second, and a sub-step of %.2g s sees %.2g of a period: it "
                "stays stable, but its swing dies out; if that swing matters, take sub-steps of %.1g s, or else make "
                "the joint rigid.",
                fast == 1 ? "The spring" : format("The fastest of %d springs,", fast).c_str(), nameOf(a).c_str(),
                nameOf(b).c_str(), fast == 1 ? "" : ",", cycles, substep(), cycles * substep(), phase / worst));
    }

    void lookAtOverlaps(const Problem<S>& problem) {
        std::set<std::pair<std::uint32_t, std::uint32_t>> told;
        for (const ProblemContact<S>& contact : problem.contacts) {
            double depth = 0;
            for (int k = contact.firstPoint; k < contact.firstPoint + contact.count; ++k) {
                depth = std::max(depth, -static_cast<double>(problem.points[static_cast<std::size_t>(k)].separation));
            }
            const std::uint32_t a = problem.bodies[static_cast<std::size_t>(contact.a)].index;
            const std::uint32_t b = problem.bodies[static_cast<std::size_t>(contact.b)].index;
            if (depth > deep && told.emplace(a, b).second) {
                add(FindingKind::Overlap, {a, b}, depth,
                    format("%s and %s overlap by %.3g mm: they are pushed apart at up to %.3g m/s; move one by that "
                           "much.",
                           nameOf(a).c_str(), nameOf(b).c_str(), 1e3 * depth, def_.maxPushOutSpeed));
            }
        }
    }

    // Hard equality rows whose gradients, in the norm of the Delassus operator, are combinations of others'.
    void lookAtRedundancy(const Problem<S>& problem) {
        std::vector<std::pair<const Row<S>*, std::size_t>> rows;  // with their block
        for (std::size_t k = 0; k < problem.joints.size(); ++k) {
            const RowBlock<S>& block = problem.blocks[k];
            for (int r = block.first; r < block.first + block.count; ++r) {
                const Row<S>& row = problem.rows[static_cast<std::size_t>(r)];
                if (!row.isVelocity && !row.isSoft() && row.lo < S(0) && row.hi > S(0)) {
                    rows.emplace_back(&row, k);
                }
            }
        }
        const auto n = static_cast<Eigen::Index>(rows.size());
        if (n < 2 || n > maxRows) {
            return;
        }
        Eigen::MatrixXd scaled = Eigen::MatrixXd::Zero(6 * static_cast<Eigen::Index>(problem.bodies.size()), n);
        for (Eigen::Index i = 0; i < n; ++i) {
            const auto& [row, k] = rows[static_cast<std::size_t>(i)];
            const RowBlock<S>& block = problem.blocks[k];
            for (int m = 0; m < block.bodyCount(); ++m) {
                const auto index = static_cast<std::size_t>(block.body(m));
                const SolverBody<S>& body = problem.bodies[index];
                if (body.fixed) {
                    continue;
                }
                const Vec6<double> g = bodyGradient(*row, block, m).template cast<double>();
                const auto at = 6 * static_cast<Eigen::Index>(index);
                scaled.block<3, 1>(at, i) += std::sqrt(static_cast<double>(body.inverseMass)) * g.head<3>();
                if (!body.particle) {
                    const Mat3d inverse = body.inverseInertia.template cast<double>();
                    const Eigen::LLT<Mat3d> root(inverse);
                    scaled.block<3, 1>(at + 3, i) += root.matrixU() * Vec3d(g.tail<3>());
                }
            }
            const double length = scaled.col(i).norm();
            if (length > 0) {
                scaled.col(i) /= length;
            }
        }
        Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
        qr.setThreshold(dependent);
        const Eigen::Index spare = n - qr.rank();
        if (spare == 0) {
            return;
        }
        const auto last = static_cast<std::size_t>(qr.colsPermutation().indices()[n - 1]);
        const auto& link = problem.joints[rows[last].second];
        const std::uint32_t a = problem.bodies[static_cast<std::size_t>(link.a)].index;
        const std::uint32_t b = problem.bodies[static_cast<std::size_t>(link.b)].index;
        add(FindingKind::RedundantJoints, {a, b}, static_cast<double>(spare),
            format(
                "%lld of %lld rows of joints repeat what others say, for example between %s and %s: their forces are "
                "shared by least squares, and errors in the anchors fight; free what another joint already holds "
                "(a ball in place of a hinge, a hinge in place of a weld).",
                static_cast<long long>(spare), static_cast<long long>(n), nameOf(a).c_str(), nameOf(b).c_str()));
    }

    const WorldDef& def_;
    const BodyTable<S>& bodies_;
    double dt_;
    double position_;
    std::vector<Finding> findings_;
};

}  // namespace

template <class S>
Diagnosis World<S>::Impl::diagnose(S dt, double position) {
    const FieldCheck given("diagnose");
    given.field("dt", static_cast<double>(dt), stepRule);
    given.field("position", position, {.text = "m, what a step may err by", .min = 0, .above = true});
    tidyAwake();
    moveProxies(static_cast<double>(dt));
    broadPhase.update(*jobs);
    // Tables of its own: what the world keeps from step to step stays as it is.
    ContactTable<S> found;
    found.update(broadPhase.pairs(), bodies, CommonDrift<S>(),
                 {def.contactMargin, static_cast<double>(dt), def.manifoldReuseDistance, def.narrowPhase}, *jobs);
    Islands<S> parts;
    parts.rebuild(bodies, awake, joints, found, false);
    const WorldTables<S> tables{bodies, joints, found, parts, {def.gravity.cast<S>(), def.gyroscopic, false}};
    Diagnosis diagnosis;
    Doctor<S> doctor(def, bodies, dt, position);
    doctor.lookAtWorld();
    const Direct<S> direct(settings());
    const Auto<S> chooser(settings());
    for (const Island& island : parts.awake()) {
        Problem<S> problem;
        Gatherer<S>(tables, island, problem).gather();
        const double work = direct.predictCost(problem).factor;
        IslandForecast& one = diagnosis.islands.emplace_back(forecast(problem, dt, position));
        one.lowest = bodies.idAt(island.lowest());
        one.directWork = work;
        const bool isSwept = chooser.plan(problem, {}, dt).sweeps();
        one.exact =
            std::holds_alternative<DirectDef>(def.solver) || (std::holds_alternative<AutoDef>(def.solver) && !isSwept);
        doctor.lookAtIsland(problem, one);
    }
    diagnosis.findings = doctor.findings();
    return diagnosis;
}

template <class S>
Diagnosis World<S>::diagnose(S dt, double position) {
    return impl_->diagnose(dt, position);
}

template Diagnosis World<float>::diagnose(float, double);
template Diagnosis World<double>::diagnose(double, double);
template Diagnosis World<float>::Impl::diagnose(float, double);
template Diagnosis World<double>::Impl::diagnose(double, double);

}  // namespace cairn
