// The Hessian H = M + J^T W J of newton.hpp: its pattern, its weights, its factor or its products, and the step that it
// gives.
#include "engine/solve/newton/cone.hpp"
#include "engine/solve/newton/newton.hpp"

#include <algorithm>

namespace cairn {
namespace {

template <class S>
void addBlock(const SparseFactor::Block& to, const Mat6<S>& value) {
    for (int r = 0; r < 6; ++r) {
        for (int c = 0; c < 6; ++c) {
            to(static_cast<std::size_t>(r), static_cast<std::size_t>(c)) += static_cast<double>(value(r, c));
        }
    }
}

}  // namespace

template <class S>
template <class P>
void ContactNewton<S>::beginGraph(const Problem<P>& problem, LinearSolver linearSolver) {
    factored_ = factored_ && linearSolver == linearSolver_;
    linearSolver_ = linearSolver;
    edges_.clear();
    node_.assign(problem.bodies.size(), -1);
    bodyOfNode_.clear();
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        if (!problem.bodies[i].fixed) {
            node_[i] = static_cast<int>(bodyOfNode_.size());
            bodyOfNode_.push_back(static_cast<int>(i));
        }
    }
}

template <class S>
void ContactNewton<S>::addEdge(int a, int b) {
    const SparseFactor::Edge edge{std::min(a, b), std::max(a, b)};
    if (edges_.empty() || edges_.back() != edge) {
        edges_.push_back(edge);
    }
}

template <class S>
void ContactNewton<S>::analyseEdges() {
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    if (linearSolver_ == LinearSolver::Factor) {
        rowsOfNode_.assign(bodyOfNode_.size(), 6);
        factor_.analyse(rowsOfNode_, edges_, infinity<double>());
    }
    productWork_ = static_cast<double>(bodyOfNode_.size() + edges_.size());
}

template <class S>
template <class P>
double ContactNewton<S>::predictWork(const Problem<P>& problem, LinearSolver linearSolver) {
    beginGraph(problem, linearSolver);
    factored_ = false;  // a pattern takes the factor's place, even where another problem is solved with it next
    const auto tie = [&](int a, int b) {
        if (a >= 0 && b >= 0 && node_[at(a)] >= 0 && node_[at(b)] >= 0) {
            addEdge(node_[at(a)], node_[at(b)]);
        }
    };
    for (const auto& link : problem.joints) {
        const std::array<int, 4> bodies{link.a, link.b, link.c, link.d};
        for (std::size_t m = 1; m < bodies.size(); ++m) {
            for (std::size_t l = 0; l < m; ++l) {
                tie(bodies[l], bodies[m]);
            }
        }
    }
    for (const ProblemContact<P>& contact : problem.contacts) {
        if (contact.count > 0) {
            tie(contact.a, contact.b);
        }
    }
    analyseEdges();
    return work();
}

template <class S>
void ContactNewton<S>::prepare(const Problem<S>& problem, LinearSolver linearSolver) {
    beginGraph(problem, linearSolver);
    for (const RowBlock<S>& block : problem.blocks) {
        forEachEdge(block, [&](std::size_t, int a, int b) { addEdge(a, b); });
    }
    analyseEdges();
    edgesOfBlock_.assign(problem.blocks.size(), {});
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        if (k > 0 && isOfSamePair(problem.blocks[k - 1], problem.blocks[k])) {
            edgesOfBlock_[k] = edgesOfBlock_[k - 1];
            continue;
        }
        forEachEdge(problem.blocks[k], [&](std::size_t pair, int a, int b) {
            const SparseFactor::Edge edge{std::min(a, b), std::max(a, b)};
            edgesOfBlock_[k][pair] =
                static_cast<std::size_t>(std::lower_bound(edges_.begin(), edges_.end(), edge) - edges_.begin());
        });
    }
    system.terms.resize(problem.rows.size());
    system.friction.resize(problem.blocks.size());
    system.p.resize(problem.rows.size());
    vStar.resize(problem.bodies.size());
    system.v.resize(problem.bodies.size());
    factored_ = factored_ && factorHolds(problem);
    isOfProblem_ = false;
}

template <class S>
bool ContactNewton<S>::factorHolds(const Problem<S>& problem) const {
    if (problem.bodies.size() != factoredPoses_.size() || problem.blocks.size() != factoredBlocks_.size() ||
        problem.rows.size() != weight_.size()) {
        return false;
    }
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        if (factoredBlocks_[k] != std::array<int, 3>{block.a, block.b, block.first}) {
            return false;
        }
    }
    const S still = static_cast<S>(reusableMotion);
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        const Pose<S>& pose = problem.bodies[i].pose;
        const Pose<S>& old = factoredPoses_[i];
        if ((pose.position - old.position).cwiseAbs().maxCoeff() > still ||
            (pose.rotation.coeffs() - old.rotation.coeffs()).cwiseAbs().maxCoeff() > still) {
            return false;
        }
    }
    return true;
}

template <class S>
bool ContactNewton<S>::weigh(const Problem<S>& problem, const std::vector<S>& y) {
    const S tight = static_cast<S>(sameWeight);
    // Of each block: nothing, some change, more than the factor bears.
    enum : std::uint8_t { Same, Changed, Anew };
    changes_.assign(problem.blocks.size(), Same);
    const auto noteChange = [&](const RowBlock<S>& block) {
        for (int m = 0; m < block.bodyCount(); ++m) {
            if (const int n = node_[at(block.body(m))]; n >= 0) {
                changedNodes_.push_back(n);
            }
        }
    };
    weight_.resize(y.size(), S(0));
    coneWeight_.resize(problem.blocks.size(), Mat3<S>::Zero());
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        const auto note = [&](bool changes, bool serves) {
            changes_[k] = std::max(changes_[k], static_cast<std::uint8_t>(!serves ? Anew : changes ? Changed : Same));
        };
        if (isCone(problem, k)) {
            const Mat3<S> w =
                coneDerivative(Vec3<S>(y[first], y[first + 1], y[first + 2]), system.friction[k]) / delta_[first];
            note(w != coneWeight_[k], (w - coneWeight_[k]).cwiseAbs().maxCoeff() <= tight * w.cwiseAbs().maxCoeff());
            coneWeight_[k] = w;
            return;
        }
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            const RowTerms<S>& t = system.terms[i];
            const S w = y[i] > t.lo && y[i] < t.hi && t.delassus > S(0) ? S(1) / (delta_[i] + t.softness) : S(0);
            note(w != weight_[i], std::abs(w - weight_[i]) <= tight * w);
            weight_[i] = w;
        }
    });
    bool same = factored_;
    for (std::size_t k = 0; k < changes_.size(); ++k) {
        same = same && changes_[k] != Anew;
        if (isOfProblem_ && changes_[k] != Same) {
            noteChange(problem.blocks[k]);
        }
    }
    return same;
}

template <class S>
bool ContactNewton<S>::factorise(const Problem<S>& problem, const std::vector<S>& y, NewtonReport& report) {
    if (weigh(problem, y)) {
        return true;
    }
    return factoriseWeighed(problem, factored_ && isOfProblem_ && linearSolver_ == LinearSolver::Factor, report);
}

template <class S>
bool ContactNewton<S>::factoriseWeighed(const Problem<S>& problem, bool isUpdate, NewtonReport& report) {
    problem.spend((isUpdate    ? updatePace
                   : factored_ ? assemblyPace
                               : firstPace) *
                  static_cast<double>(problem.rows.size()));
    assemble(problem, isUpdate);
    ++report.factorisations;
    system.blockProducts += linearSolver_ == LinearSolver::Factor ? factor_.work() : 0;
    factored_ = linearSolver_ == LinearSolver::Factor ? factor_.factor(problem.jobs, problem.pace) : diagonal_.invert();
    isOfProblem_ = factored_;
    changedNodes_.clear();
    factoredPoses_.clear();
    for (const SolverBody<S>& body : problem.bodies) {
        factoredPoses_.push_back(body.pose);
    }
    factoredBlocks_.clear();
    for (const RowBlock<S>& block : problem.blocks) {
        factoredBlocks_.push_back({block.a, block.b, block.first});
    }
    return factored_;
}

// Adds J^T W J of a block to those of its bodies, each with itself and, for a factor, with the others. False: it has no
// weight.
template <class S>
bool ContactNewton<S>::addWeighted(const Problem<S>& problem, std::size_t k, std::array<Mat6<S>, 4>& diagonal,
                                   std::array<Mat6<S>, 6>& off) const {
    const RowBlock<S>& block = problem.blocks[k];
    const bool whole = linearSolver_ == LinearSolver::Factor;
    bool any = false;
    // `weighted(k)`: the row's gradients for body k, weighted.
    const auto add = [&](const auto& weighted, const Row<S>& row) {
        any = true;
        for (int m = 0; m < block.bodyCount(); ++m) {
            const Vec6<S> left = weighted(m);
            diagonal[at(m)].noalias() += left * bodyGradient(row, block, m).transpose();
            for (int l = 0; whole && l < m; ++l) {
                off[pairOf(l, m)].noalias() += bodyGradient(row, block, l) * left.transpose();
            }
        }
    };
    if (isCone(problem, k)) {
        const Mat3<S>& w = coneWeight_[k];
        const Row<S>* row = &problem.rows[at(block.first)];
        for (int r = 0; r < 3 && w.trace() > S(0); ++r) {
            add(
                [&](int m) -> Vec6<S> {
                    return m == 0 ? w(r, 0) * row[0].a + w(r, 1) * row[1].a + w(r, 2) * row[2].a
                                  : w(r, 0) * row[0].b + w(r, 1) * row[1].b + w(r, 2) * row[2].b;
                },
                row[r]);
        }
        return any;
    }
    for (std::size_t i = at(block.first); i < at(block.first + block.count); ++i) {
        if (weight_[i] > S(0)) {
            const Row<S>& row = problem.rows[i];
            add([&](int m) -> Vec6<S> { return weight_[i] * bodyGradient(row, block, m); }, row);
        }
    }
    return any;
}

template <class S>
void ContactNewton<S>::addDiagonal(int node, const Mat6<S>& value) {
    if (linearSolver_ == LinearSolver::Factor) {
        addBlock(factor_.diagonal(node), value);
    } else {
        diagonal_.addDiagonal(node, value);
    }
}

template <class S>
void ContactNewton<S>::assemble(const Problem<S>& problem, bool isUpdate) {
    const bool whole = linearSolver_ == LinearSolver::Factor;
    if (isUpdate) {
        factor_.setZeroAround(changedNodes_);
    } else if (whole) {
        factor_.setZero(rowsOfNode_);
    } else {
        diagonal_.setZero(bodyOfNode_.size());
    }
    const auto takes = [&](int node) { return node >= 0 && (!isUpdate || factor_.takes(node)); };
    problem.forEach(bodyOfNode_.size(), [&](std::size_t n) {
        if (!takes(static_cast<int>(n))) {
            return;
        }
        const SolverBody<S>& body = problem.bodies[at(bodyOfNode_[n])];
        Mat6<S> mass = Mat6<S>::Zero();
        mass.template topLeftCorner<3, 3>().diagonal().setConstant(body.mass);
        if (body.particle) {
            mass.template bottomRightCorner<3, 3>().diagonal().setConstant(
                body.mass);  // of no effect: it does not turn
        } else {
            mass.template bottomRightCorner<3, 3>() = body.inertia;
        }
        addDiagonal(static_cast<int>(n), mass);
    });
    if (problem.jobs == nullptr) {
        addBlocks(problem, 0, problem.blocks.size(), isUpdate);
        return;
    }
    const std::size_t joints = static_cast<std::size_t>(problem.jointBlocks);
    addBlocks(problem, 0, joints, isUpdate);
    problem.forContactsApart([&](const ProblemContact<S>& contact) {
        const std::size_t first = joints + at(contact.firstPoint);
        addBlocks(problem, first, first + at(contact.count), isUpdate);
    });
}

template <class S>
void ContactNewton<S>::addBlocks(const Problem<S>& problem, std::size_t begin, std::size_t end, bool isUpdate) {
    const bool whole = linearSolver_ == LinearSolver::Factor;
    const auto takes = [&](int node) { return node >= 0 && (!isUpdate || factor_.takes(node)); };
    std::array<Mat6<S>, 4> diagonal;
    std::array<Mat6<S>, 6> off;
    bool any = false;
    for (std::size_t k = begin; k < end; ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        bool isTaken = false;
        for (int m = 0; m < block.bodyCount(); ++m) {
            isTaken = isTaken || takes(node_[at(block.body(m))]);
        }
        if (!isTaken) {
            continue;
        }
        if (!any) {
            diagonal.fill(Mat6<S>::Zero());
            off.fill(Mat6<S>::Zero());
        }
        any = addWeighted(problem, k, diagonal, off) || any;
        // The points of a manifold go in together.
        const bool goesOn = k + 1 < end && isOfSamePair(block, problem.blocks[k + 1]);
        if (!any || goesOn) {
            continue;
        }
        any = false;
        for (int m = 0; m < block.bodyCount(); ++m) {
            if (const int n = node_[at(block.body(m))]; takes(n)) {
                addDiagonal(n, diagonal[at(m)]);
            }
        }
        if (!whole) {
            continue;
        }
        forEachEdge(block, [&](std::size_t pair, int a, int b) {
            const std::size_t edge = edgesOfBlock_[k][pair];
            if (isUpdate && !factor_.takesEdge(edge)) {
                return;
            }
            addBlock(a > b ? factor_.transposedEdge(edge) : factor_.edge(edge), off[pair]);
        });
    }
}

template <class S>
void ContactNewton<S>::product(const Problem<S>& problem, const std::vector<Vec6<S>>& x, std::vector<Vec6<S>>& y) {
    wide_.assign(problem.bodies.size(), Vec6<S>::Zero());
    for (std::size_t n = 0; n < x.size(); ++n) {
        const std::size_t body = at(bodyOfNode_[n]);
        wide_[body] = x[n];
        y[n] = problem.bodies[body].applyMass(x[n]);
    }
    system.visits += problem.rows.size();
    const auto twist = [&](int k) -> const Vec6<S>& { return wide_[at(k)]; };
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        const auto push = [&](std::size_t row, S impulse) {
            for (int m = 0; m < block.bodyCount(); ++m) {
                if (const int n = node_[at(block.body(m))]; n >= 0) {
                    y[at(n)] += bodyGradient(problem.rows[row], block, m) * impulse;
                }
            }
        };
        if (isCone(problem, k)) {
            const Mat3<S>& w = coneWeight_[k];
            if (w.trace() > S(0)) {
                Vec3<S> u;
                for (int r = 0; r < 3; ++r) {
                    u(r) = rowDot(problem.rows[first + at(r)], block, twist);
                }
                const Vec3<S> impulse = w * u;
                for (int r = 0; r < 3; ++r) {
                    push(first + at(r), impulse(r));
                }
            }
            continue;
        }
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            if (weight_[i] > S(0)) {
                push(i, weight_[i] * rowDot(problem.rows[i], block, twist));
            }
        }
    }
}

template <class S>
void ContactNewton<S>::newtonStep(const Problem<S>& problem, std::vector<Vec6<S>>& g, NewtonReport& report) {
    for (Vec6<S>& block : g) {
        block = -block;
    }
    if (linearSolver_ == LinearSolver::Factor) {
        for (std::size_t n = 0; n < g.size(); ++n) {
            Eigen::Map<Vec6<double>>(factor_.right(static_cast<int>(n))) = g[n].template cast<double>();
        }
        problem.spend(static_cast<double>(problem.rows.size()));
        factor_.substitute(problem.jobs);
        for (std::size_t n = 0; n < g.size(); ++n) {
            g[n] = Eigen::Map<const Vec6<double>>(factor_.right(static_cast<int>(n))).template cast<S>();
        }
        system.blockProducts += factor_.substitutionWork();
        return;
    }
    report.products += conjugateGradients<S>([&](const auto& x, auto& y) { product(problem, x, y); }, diagonal_,
                                             static_cast<S>(stepShare), maxProducts, g);
}

template class ContactNewton<float>;
template class ContactNewton<double>;
template double ContactNewton<double>::predictWork(const Problem<float>&, LinearSolver);
template double ContactNewton<double>::predictWork(const Problem<double>&, LinearSolver);

}  // namespace cairn
