#pragma once
// How fast the engine's own solvers converge on the straight chain of theory sections 9.2 to 9.4.
//
// The chain: N bodies, the inner ones of 1 kg, the ends of R kg; each of its N - 1 rows starts 1 m too long, impulses
// start at 0, rows are taken from the first to the last. An iteration is one sweep over rows (or over bodies, with one
// update of the multipliers). Counted is the first iteration after which a share a of the start is gone,
//     error:     |lambda - lambda*| <= (1 - a) |lambda*|     (solvers over bodies: of the displacements, in the norm of
//     M) residual:  |C| <= (1 - a) |C_0|
#include <nlohmann/json.hpp>

#include <array>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace cairn {

inline constexpr std::array<double, 4> removedShares = {0.5, 0.9, 0.99, 0.999};  // a

struct MethodConvergence {
    std::string name = {};
    double relaxation = 1;  // of methods that have one
    double penalty = 0;     // kg, rho dt^2, of solvers over bodies
    // Spectral radius of an iteration, each where the method has one: the eigenvalues of what one iteration of the
    // solver does to each unit vector; the eigenvalues of the matrix that the theory makes from the assembled A; power
    // iteration as the running solver sees it.
    std::optional<double> rate = {};
    std::optional<double> rateOfMatrix = {};
    std::optional<double> rateByPower = {};
    std::array<int, 4> error{};  // 0: not within the cap
    std::array<int, 4> residual{};
    std::vector<double> history = {};  // |error| / |error at the start| after 0, 1, 2, ... iterations

    // perE() of the rate; 0 without one.
    double perFactorE() const;
};

struct ChainConvergence {
    int bodies = 10;
    double ratio = 1;           // R, kg
    double jacobiRadius = 0;    // by the eigenvalues of D^-1 A
    double bestRelaxation = 1;  // 2 / (1 + sqrt(1 - rho_J^2)), theory 5.12
    std::vector<MethodConvergence> methods = {};

    const MethodConvergence& method(const std::string& name) const;
};

// `count` masses: the ends `end` kg, the others 1 kg.
std::vector<double> chainMasses(int count, double end);

// Told of the share that is done.
using Tell = std::function<void(double)>;

// All methods over rows, on one chain. `cap`: most iterations.
ChainConvergence chainConvergence(int bodies, double ratio, int cap = 100000);

// One iteration of the augmented Lagrangian over bodies: one sweep over the bodies, then the multipliers.
// `penalty` of each row, kg: rho dt^2; it grows by `growth` (kg/m, beta dt^2) times |C| after every iteration.
struct AvbdRule {
    std::string name = {};
    std::vector<double> penalty = {};
    double growth = 0;
    double error = 1;        // m, of each row at the start
    bool symmetric = false;  // the engine's own: there and back
};
MethodConvergence avbdConvergence(const std::vector<double>& masses, const AvbdRule& rule, int cap);
// Spectral radius of it with constant penalties, displacements and multipliers together; and of its sweep over bodies
// alone, multipliers held.
double avbdRadius(const std::vector<double>& masses, const std::vector<double>& penalty, bool symmetric = false);
double bodySweepRadius(const std::vector<double>& masses, const std::vector<double>& penalty);
// |sum of m v| over the sum of |m v| after each of so many iterations: what no force gave (theory section 7.2).
std::vector<double> avbdMomentum(const std::vector<double>& masses, const std::vector<double>& penalty, bool symmetric,
                                 int iterations);
struct BestPenalty {
    double penalty = 0;  // kg, the same for every row
    double radius = 1;
};
BestPenalty bestPenalty(const std::vector<double>& masses, bool symmetric = false);

// Jacobi radius of a chain of any masses (0: held), from the rows.
double chainJacobiRadius(const std::vector<double>& masses);
// The relaxation that suits a Jacobi radius best, theory 5.12.
double bestRelaxationOf(double jacobiRadius);
// Iterations that divide the error by e: -1 / ln(radius).
double perE(double radius);

struct AvbdRow {
    AvbdRule rule = {};
    std::vector<MethodConvergence> byRatio = {};  // as ConvergenceStudy::ratios
};
struct LayoutRow {
    std::string name = {};
    std::vector<double> perFactorE = {};      // Gauss-Seidel, R = 10, 100, 1000
    std::vector<double> perFactorEBest = {};  // with the best relaxation
};
struct LengthRow {
    int bodies = 0;
    double gaussSeidel = 0;  // iterations for a factor of e; equal masses
    double best = 0;         // the same with the best relaxation
    double avbd = 0;         // sweep and multipliers at the best constant penalty, equal masses
    double bodySweep = 0;    // multipliers held, penalty R = 1000
};

struct ConvergenceStudy {
    std::vector<double> ratios = {};  // R, kg
    std::vector<ChainConvergence> chains = {};
    std::vector<AvbdRow> avbd = {};
    std::vector<BestPenalty> best, bestSymmetric;  // by ratio
    std::vector<LayoutRow> layouts = {};
    std::vector<LengthRow> lengths = {};
};
// `full`: counts up to the slowest method's end; otherwise to 100,000 iterations.
ConvergenceStudy convergenceStudy(bool full, const Tell& tell = {});

nlohmann::ordered_json toJson(const ConvergenceStudy& study);

}  // namespace cairn
