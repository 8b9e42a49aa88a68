#include "command/studies/convergence.hpp"
#include "command/studies/straight_chain.hpp"
#include "engine/solve/position/block_coordinate_descent.hpp"
#include "engine/solve/velocity/gauss_seidel.hpp"

#include <map>

namespace cairn {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using System = RowSystem<double>;
using Sweep = std::function<void(System&)>;

constexpr std::size_t longestHistory = 400;

// |error| and |residual|, as shares of those at the start.
struct Left {
    double error = 1;
    double residual = 1;
};

Vector toVector(const std::vector<double>& x) {
    return Eigen::Map<const Vector>(x.data(), static_cast<Eigen::Index>(x.size()));
}

double spectralRadius(const Matrix& G) {
    return Eigen::EigenSolver<Matrix>(G, false).eigenvalues().cwiseAbs().maxCoeff();
}

// Marks the levels that `left` reaches at iteration k and not before. True once all are reached.
bool note(MethodConvergence& method, int k, const Left& left) {
    bool all = true;
    // The start's own round-off must not decide where a method lands exactly on a level.
    constexpr double even = 1 + 1e-12;
    for (std::size_t a = 0; a < removedShares.size(); ++a) {
        const double limit = (1 - removedShares[a]) * even;
        if (method.error[a] == 0 && left.error <= limit) {
            method.error[a] = k;
        }
        if (method.residual[a] == 0 && left.residual <= limit) {
            method.residual[a] = k;
        }
        all = all && method.error[a] > 0 && method.residual[a] > 0;
    }
    return all;
}

// `step`: one iteration; gives what is left after it.
template <class Step>
void count(MethodConvergence& method, int cap, const Step& step) {
    method.history.push_back(1);
    for (int k = 1; k <= cap; ++k) {
        const Left left = step();
        if (method.history.size() < longestHistory) {
            method.history.push_back(left.error);
        }
        if (note(method, k, left) && method.history.size() >= longestHistory) {
            return;
        }
    }
}

// The same for a method whose iterations hang together: `run(n)` starts anew and gives what is left after n. Every n
// is tried up to 100; beyond, the first is looked for as if what is left only fell, to 1 %.
template <class Run>
void countRuns(MethodConvergence& method, int cap, const Run& run) {
    std::map<int, Left> known;
    const auto left = [&](int n) {
        const auto [place, isNew] = known.try_emplace(n);
        if (isNew) {
            place->second = run(n);
        }
        return place->second;
    };
    constexpr int linear = 100;
    method.history.push_back(1);
    bool all = false;
    for (int n = 1; n <= linear; ++n) {
        method.history.push_back(left(n).error);
        all = note(method, n, left(n));
    }
    for (int n = linear; !all && n < cap; n += n / 4) {
        all = note(method, n, left(n));
    }
    const auto refine = [&](int& found, double Left::*which, double limit) {
        if (found <= linear) {
            return;
        }
        int high = found;
        int low = linear;
        for (const auto& [n, share] : known) {
            if (n < high && share.*which > limit) {
                low = std::max(low, n);
            }
        }
        while (high - low > std::max(1, high / 100)) {
            const int middle = (low + high) / 2;
            (left(middle).*which <= limit ? high : low) = middle;
        }
        found = high;
    };
    for (std::size_t a = 0; a < removedShares.size(); ++a) {
        refine(method.error[a], &Left::error, 1 - removedShares[a]);
        refine(method.residual[a], &Left::residual, 1 - removedShares[a]);
    }
}

// Of solvers over rows.
struct RowChain {
    StraightChain chain;
    Matrix A;
    Vector c;       // m/s, the right side
    Vector answer;  // N s, -A^-1 c
    System start;

    explicit RowChain(const std::vector<double>& masses)
        : chain(masses), A(assembleA(chain.problem)), start(chain.system()) {
        c.resize(A.rows());
        for (Eigen::Index i = 0; i < c.size(); ++i) {
            c(i) = start.terms[static_cast<std::size_t>(i)].bias;
        }
        answer = -A.llt().solve(c);
    }

    Left left(const Vector& p) const { return {(p - answer).norm() / answer.norm(), (c + A * p).norm() / c.norm()}; }

    System unforced() const {
        System system = start;
        for (RowTerms<double>& t : system.terms) {
            t.bias = 0;
        }
        return system;
    }

    // What one sweep makes of each unit vector of impulses.
    Matrix iterationMatrix(const Sweep& sweep) const {
        Matrix G(A.rows(), A.rows());
        for (Eigen::Index j = 0; j < A.rows(); ++j) {
            System system = unforced();
            std::vector<double> unit(system.p.size(), 0);
            unit[static_cast<std::size_t>(j)] = 1;
            system.push(chain.problem, unit);
            sweep(system);
            G.col(j) = toVector(system.p);
        }
        return G;
    }

    Matrix gaussSeidelMatrix(double relaxation) const {
        const Matrix D = A.diagonal().asDiagonal();
        const Matrix L = A.triangularView<Eigen::StrictlyLower>();
        return (D + relaxation * L).partialPivLu().solve((1 - relaxation) * D - relaxation * L.transpose());
    }

    // A x, by pushing the bodies and asking the rows.
    Vector product(const Vector& x) const {
        System system = unforced();
        system.push(chain.problem, std::vector<double>(x.data(), x.data() + x.size()));
        Vector y(x.size());
        for (const RowBlock<double>& block : chain.problem.blocks) {
            y(block.first) = system.rowVelocity(chain.problem.rows[static_cast<std::size_t>(block.first)], block);
        }
        return y;
    }
};

void measureSweeps(MethodConvergence& method, const RowChain& rows, int cap, const Sweep& sweep) {
    method.rate = spectralRadius(rows.iterationMatrix(sweep));
    System system = rows.start;
    count(method, cap, [&] {
        sweep(system);
        return rows.left(toVector(system.p));
    });
}

MethodConvergence gaussSeidel(const RowChain& rows, const std::string& name, double relaxation, int cap) {
    MethodConvergence method{.name = name, .relaxation = relaxation};
    measureSweeps(method, rows, cap, [&](System& system) { system.sweep(rows.chain.problem, relaxation); });
    method.rateOfMatrix = spectralRadius(rows.gaussSeidelMatrix(relaxation));
    if (relaxation == 1) {
        System system = rows.unforced();
        system.push(rows.chain.problem, std::vector<double>(system.p.size(), 1));
        double before = 0;
        for (int k = 0; k < 400; ++k) {
            const double change = system.sweep(rows.chain.problem, 1);
            method.rateByPower = std::sqrt(change / before);
            before = change;
        }
    }
    return method;
}

MethodConvergence jacobi(const RowChain& rows, const std::string& name, bool splitMasses, int cap) {
    const Splitting<double> split(rows.chain.problem, splitMasses);
    MethodConvergence method{.name = name};
    measureSweeps(method, rows, cap, [&](System& system) { system.sweepAtOnce(rows.chain.problem, 1, split); });
    const Vector D = toVector(split.delassus);
    method.rateOfMatrix =
        spectralRadius(Matrix::Identity(D.size(), D.size()) - Matrix(D.cwiseInverse().asDiagonal() * rows.A));
    if (!splitMasses) {
        std::vector<double> mode;
        method.rateByPower = jacobiRadius(rows.chain.problem, rows.start, mode, 400);
    }
    return method;
}

// A solver's own iterate(), from zero.
MethodConvergence solverRuns(RowChain& rows, const std::string& name, const SolverDef& def, int cap) {
    const std::unique_ptr<Solver<double>> solver = makeSolver<double>(def);
    auto* const impulses = dynamic_cast<ImpulseSolver<double>*>(solver.get());
    CAIRN_CHECK(impulses != nullptr, "a solver on impulses");
    MethodConvergence method{.name = name};
    countRuns(method, cap, [&](int n) {
        System system = rows.start;
        rows.chain.problem.memory = {};
        impulses->iterate(rows.chain.problem, system, n);
        return rows.left(toVector(system.p));
    });
    return method;
}

MethodConvergence conjugateGradients(const RowChain& rows, const std::string& name, bool preconditioned, int cap) {
    MethodConvergence method{.name = name};
    const Vector D = preconditioned ? Vector(rows.A.diagonal()) : Vector(Vector::Ones(rows.c.size()));
    Vector p = Vector::Zero(rows.c.size());
    Vector r = -rows.c;
    Vector z = r.cwiseQuotient(D);
    Vector direction = z;
    double rz = r.dot(z);
    count(method, std::min(cap, static_cast<int>(4 * rows.c.size())), [&] {
        const Vector along = rows.product(direction);
        const double curvature = direction.dot(along);
        const double width = curvature > 0 ? rz / curvature : 0;
        p += width * direction;
        r -= width * along;
        z = r.cwiseQuotient(D);
        const double next = r.dot(z);
        direction = z + (rz > 0 ? next / rz : 0) * direction;
        rz = next;
        return rows.left(p);
    });
    return method;
}

// The state of a solver over bodies: displacements of the bodies that move along the line, then multipliers.
class BodyChain {
public:
    BodyChain(const std::vector<double>& masses, double error, const std::vector<double>& penalty)
        : chain_(masses, error),
          system_(chain_.system()),
          descent_(chain_.problem, system_, 1, std::numeric_limits<double>::max(), false, LoadRule::Heaviest, 1) {
        setPenalty(penalty);
        const RowChain rows(masses);
        const Vector p = error * rows.answer;
        const Matrix J = assembleJ(rows.chain.problem);
        for (std::size_t i = 0; i < masses.size(); ++i) {
            const SolverBody<double>& body = chain_.problem.bodies[i];
            const Vec6<double> push = J.middleCols<6>(6 * static_cast<Eigen::Index>(i)).transpose() * p;
            answer_.push_back(body.applyInverseMass(push).x());
            if (!body.fixed) {
                free_.push_back(i);
            }
        }
        startError_ = error * std::sqrt(static_cast<double>(descent_.centre.size()));
    }

    void setPenalty(const std::vector<double>& penalty) {
        for (std::size_t i = 0; i < penalty.size(); ++i) {
            descent_.delta[i] = 1 / penalty[i];
        }
    }

    void sweep() { descent_.sweep(false); }
    void iterate(bool symmetric) {
        if (symmetric) {
            descent_.descend();
        } else {
            sweep();
        }
        descent_.moveCentres();
    }

    double rowError(std::size_t i) const { return chain_.problem.rows[i].C; }

    Left left() const {
        double squared = 0;
        double whole = 0;
        for (const std::size_t i : free_) {
            const double mass = chain_.problem.bodies[i].mass;
            squared += mass * std::pow(system_.v[i].x() - answer_[i], 2);
            whole += mass * answer_[i] * answer_[i];
        }
        double c = 0;
        for (const Row<double>& row : chain_.problem.rows) {
            c += row.C * row.C;
        }
        return {std::sqrt(squared / whole), std::sqrt(c) / startError_};
    }

    double momentumDefect() const {
        double sum = 0;
        double size = 0;
        for (const std::size_t i : free_) {
            const double momentum = chain_.problem.bodies[i].mass * system_.v[i].x();
            sum += momentum;
            size += std::abs(momentum);
        }
        return std::abs(sum) / size;
    }

    Eigen::Index size(bool multipliers) const {
        return static_cast<Eigen::Index>(free_.size() + (multipliers ? descent_.centre.size() : 0));
    }
    Vector state(bool multipliers) const {
        Vector s(size(multipliers));
        Eigen::Index k = 0;
        for (const std::size_t i : free_) {
            s(k++) = system_.v[i].x();
        }
        for (std::size_t i = 0; multipliers && i < descent_.centre.size(); ++i) {
            s(k++) = descent_.centre[i];
        }
        return s;
    }
    void setState(const Vector& s) {
        Eigen::Index k = 0;
        for (const std::size_t i : free_) {
            system_.v[i].x() = s(k++);
        }
        for (double& centre : descent_.centre) {
            centre = k < s.size() ? s(k++) : 0;
        }
        descent_.follow();
    }

    // Of what `step` does to the state, which is affine in it.
    template <class Step>
    double radius(bool multipliers, const Step& step) {
        const Eigen::Index n = size(multipliers);
        const auto image = [&](const Vector& s) {
            setState(s);
            step();
            return state(multipliers);
        };
        const Vector zero = image(Vector::Zero(n));
        Matrix G(n, n);
        for (Eigen::Index j = 0; j < n; ++j) {
            G.col(j) = image(Vector::Unit(n, j)) - zero;
        }
        return spectralRadius(G);
    }

private:
    StraightChain chain_;
    System system_;
    BlockCoordinateDescent<double> descent_;
    std::vector<std::size_t> free_;
    std::vector<double> answer_;
    double startError_ = 1;
};

}  // namespace

double perE(double radius) {
    return radius > 0 ? -1 / std::log(radius) : 0;
}

double bestRelaxationOf(double jacobiRadius) {
    return 2 / (1 + std::sqrt(1 - jacobiRadius * jacobiRadius));
}

double MethodConvergence::perFactorE() const {
    return rate ? perE(*rate) : 0;
}

const MethodConvergence& ChainConvergence::method(const std::string& name) const {
    for (const MethodConvergence& m : methods) {
        if (m.name == name) {
            return m;
        }
    }
    throw InputError("method", name, "not one of the study's");
}

double chainJacobiRadius(const std::vector<double>& masses) {
    const RowChain rows(masses);
    const Splitting<double> whole(rows.chain.problem, false);
    return spectralRadius(
        rows.iterationMatrix([&](System& system) { system.sweepAtOnce(rows.chain.problem, 1, whole); }));
}

std::vector<double> chainMasses(int count, double end) {
    std::vector<double> masses(static_cast<std::size_t>(count), 1);
    masses.front() = masses.back() = end;
    return masses;
}

ChainConvergence chainConvergence(int bodies, double ratio, int cap) {
    ChainConvergence result{.bodies = bodies, .ratio = ratio};
    RowChain rows(chainMasses(bodies, ratio));
    const Vector D = rows.A.diagonal();
    result.jacobiRadius =
        spectralRadius(Matrix::Identity(D.size(), D.size()) - Matrix(D.cwiseInverse().asDiagonal() * rows.A));
    result.bestRelaxation = bestRelaxationOf(result.jacobiRadius);
    auto& methods = result.methods;
    methods.push_back(jacobi(rows, "jacobi", false, cap));
    methods.push_back(gaussSeidel(rows, "gauss_seidel", 1, cap));
    methods.push_back(gaussSeidel(rows, "sor, best", result.bestRelaxation, cap));
    methods.push_back(gaussSeidel(rows, "sor, 1.5", 1.5, cap));
    methods.push_back(
        solverRuns(rows, "gauss_seidel, optimal", GaussSeidelDef{.relaxationRule = RelaxationRule::Optimal}, cap));
    methods.push_back(
        solverRuns(rows, "gauss_seidel, adaptive", GaussSeidelDef{.relaxationRule = RelaxationRule::Adaptive}, cap));
    methods.push_back(jacobi(rows, "jacobi, masses split", true, cap));
    methods.push_back(solverRuns(rows, "jacobi, masses split, chebyshev", JacobiDef{.chebyshev = true}, cap));
    methods.push_back(solverRuns(rows, "jacobi, chebyshev", JacobiDef{.massSplitting = false, .chebyshev = true}, cap));
    methods.push_back(solverRuns(rows, "nncg", NncgDef{}, cap));
    methods.push_back(conjugateGradients(rows, "cg", false, cap));
    methods.push_back(conjugateGradients(rows, "cg, by diagonal", true, cap));
    return result;
}

MethodConvergence avbdConvergence(const std::vector<double>& masses, const AvbdRule& rule, int cap) {
    MethodConvergence method{.name = rule.name, .penalty = rule.penalty.front()};
    if (rule.growth == 0) {
        method.rate = avbdRadius(masses, rule.penalty, rule.symmetric);
    }
    BodyChain chain(masses, rule.error, rule.penalty);
    std::vector<double> penalty = rule.penalty;
    count(method, cap, [&] {
        chain.iterate(rule.symmetric);
        if (rule.growth > 0) {
            for (std::size_t i = 0; i < penalty.size(); ++i) {
                penalty[i] += rule.growth * std::abs(chain.rowError(i));
            }
            chain.setPenalty(penalty);
        }
        return chain.left();
    });
    return method;
}

double avbdRadius(const std::vector<double>& masses, const std::vector<double>& penalty, bool symmetric) {
    BodyChain chain(masses, 1, penalty);
    return chain.radius(true, [&] { chain.iterate(symmetric); });
}

double bodySweepRadius(const std::vector<double>& masses, const std::vector<double>& penalty) {
    BodyChain chain(masses, 1, penalty);
    return chain.radius(false, [&] { chain.sweep(); });
}

std::vector<double> avbdMomentum(const std::vector<double>& masses, const std::vector<double>& penalty, bool symmetric,
                                 int iterations) {
    BodyChain chain(masses, 1, penalty);
    std::vector<double> defects;
    for (int k = 0; k < iterations; ++k) {
        chain.iterate(symmetric);
        defects.push_back(chain.momentumDefect());
    }
    return defects;
}

BestPenalty bestPenalty(const std::vector<double>& masses, bool symmetric) {
    const auto radius = [&](double logPenalty) {
        return avbdRadius(masses, std::vector<double>(masses.size() - 1, std::pow(10, logPenalty)), symmetric);
    };
    constexpr int perDecade = 10;
    double best = 0;
    double smallest = std::numeric_limits<double>::infinity();
    for (int k = -perDecade; k <= 4 * perDecade; ++k) {
        const double at = static_cast<double>(k) / perDecade;
        if (const double r = radius(at); r < smallest) {
            smallest = r;
            best = at;
        }
    }
    // Golden section between the neighbours of the best.
    const double golden = (std::sqrt(5.0) - 1) / 2;
    double low = best - 1.0 / perDecade;
    double high = best + 1.0 / perDecade;
    for (int k = 0; k < 16; ++k) {
        const double a = high - golden * (high - low);
        const double b = low + golden * (high - low);
        (radius(a) < radius(b) ? high : low) = radius(a) < radius(b) ? b : a;
    }
    const double at = (low + high) / 2;
    return {std::pow(10, at), radius(at)};
}

}  // namespace cairn
