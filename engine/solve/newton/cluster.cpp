// Cluster: Gauss-Seidel whose unit is a cluster of bodies. The rows that touch a cluster's bodies are solved exactly
// together (newton.hpp, theory 8.10), all other impulses standing still:
//     (p_c, v) <- argmin of the contact problem over the rows of c,   cluster after cluster.
// A cluster's border bodies move with their full mass, so that momentum is kept at every visit and no penalty has to be
// chosen for the border: block Gauss-Seidel on impulses, which converges for any clusters. ClusterDef::clusterSize is
// the dial: all bodies of the island in one cluster is `direct` without its joint correction, one body a cluster is
// Gauss-Seidel with a body's contacts solved together.
// Clusters grow along load paths: from the body that carries most to the neighbour it presses hardest, so that a column
// under load lies within one. Cost: a factor of each cluster a Newton iteration; linear in the number of clusters.
#include "engine/solve/newton/newton.hpp"
#include "engine/solve/velocity/impulse_solver.hpp"

#include <map>

namespace cairn {
namespace {

template <class S>
struct Cluster {
    Problem<S> part;
    std::vector<std::size_t> bodies;  // of the island, for each of the part
    std::vector<std::size_t> blocks;
    ContactNewton<S> newton;
};

// Body after body to clusters of at most `size`: by the force between neighbours, hardest first.
template <class S>
std::vector<int> assignBodies(const Problem<S>& problem, const std::vector<S>& p, int size, int& clusters) {
    std::vector<std::map<int, S>> neighbours(problem.bodies.size());
    std::vector<S> carried(problem.bodies.size(), S(0));
    for (const RowBlock<S>& block : problem.blocks) {
        S force = 0;
        for (int i = block.first; i < block.first + block.count; ++i) {
            force += std::abs(p[static_cast<std::size_t>(i)]);
        }
        for (int k = 0; k < block.bodyCount(); ++k) {
            carried[static_cast<std::size_t>(block.body(k))] += force;
            for (int l = 0; l < k; ++l) {
                neighbours[static_cast<std::size_t>(block.body(k))][block.body(l)] += force;
                neighbours[static_cast<std::size_t>(block.body(l))][block.body(k)] += force;
            }
        }
    }
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        if (!problem.bodies[i].fixed) {
            order.push_back(i);
        }
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return carried[a] > carried[b]; });
    std::vector<int> cluster(problem.bodies.size(), -1);
    clusters = 0;
    for (const std::size_t seed : order) {
        if (cluster[seed] >= 0) {
            continue;
        }
        std::map<int, S> border;  // what presses on the cluster, by body
        int count = 0;
        for (int next = static_cast<int>(seed); next >= 0;) {
            cluster[static_cast<std::size_t>(next)] = clusters;
            border.erase(next);
            for (const auto& [body, force] : neighbours[static_cast<std::size_t>(next)]) {
                if (!problem.bodies[static_cast<std::size_t>(body)].fixed &&
                    cluster[static_cast<std::size_t>(body)] < 0) {
                    border[body] += force;
                }
            }
            next = -1;
            if (++count < size && !border.empty()) {
                next = std::max_element(border.begin(), border.end(), [](const auto& a, const auto& b) {
                           return a.second < b.second;
                       })->first;
            }
        }
        ++clusters;
    }
    return cluster;
}

template <class S>
class ClusterSolver final : public ImpulseSolver<S> {
public:
    explicit ClusterSolver(const SolverSettings& settings)
        : ImpulseSolver<S>(settings, ContactForm::Rows,
                           {.substeps = 2, .iterations = 2, .pushOut = {.phase = 5, .dampingRatio = 5}}),
          size_(settings.def.clusterSize > 0 ? settings.def.clusterSize : 16) {}

private:
    using ImpulseSolver<S>::iterate;
    void iterate(Problem<S>& problem, RowSystem<S>& system, int iterations) override {
        std::vector<Cluster<S>> clusters = split(problem, system);
        for (int k = 0; k < iterations; ++k) {
            for (std::size_t n = 0; n < clusters.size(); ++n) {
                solve(clusters[k % 2 == 0 ? n : clusters.size() - 1 - n], clusters.size() == 1, problem, system);
            }
        }
    }

    std::vector<Cluster<S>> split(const Problem<S>& problem, const RowSystem<S>& system) const {
        int count = 0;
        const std::vector<int> clusterOf = assignBodies(problem, system.p, size_, count);
        std::vector<Cluster<S>> clusters(static_cast<std::size_t>(count));
        for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
            const RowBlock<S>& block = problem.blocks[k];
            int cluster = -1;  // the first of those that the block's bodies are in
            for (int n = 0; n < block.bodyCount(); ++n) {
                const int own = clusterOf[static_cast<std::size_t>(block.body(n))];
                cluster = own >= 0 && (cluster < 0 || own < cluster) ? own : cluster;
            }
            if (cluster >= 0) {
                clusters[static_cast<std::size_t>(cluster)].blocks.push_back(k);
            }
        }
        std::vector<int> local(problem.bodies.size());
        for (Cluster<S>& cluster : clusters) {
            std::fill(local.begin(), local.end(), -1);
            const auto localOf = [&](int body) {
                if (body < 0) {
                    return -1;
                }
                int& place = local[static_cast<std::size_t>(body)];
                if (place < 0) {
                    place = static_cast<int>(cluster.bodies.size());
                    cluster.bodies.push_back(static_cast<std::size_t>(body));
                    cluster.part.bodies.push_back(problem.bodies[static_cast<std::size_t>(body)]);
                }
                return place;
            };
            for (const std::size_t k : cluster.blocks) {
                RowBlock<S> block = problem.blocks[k];
                const std::size_t first = static_cast<std::size_t>(block.first);
                block.a = localOf(block.a);
                block.b = localOf(block.b);
                block.c = localOf(block.c);
                block.d = localOf(block.d);
                block.first = static_cast<int>(cluster.part.rows.size());
                cluster.part.blocks.push_back(block);
                for (std::size_t i = first; i < first + static_cast<std::size_t>(block.count); ++i) {
                    cluster.part.rows.push_back(problem.rows[i]);
                    cluster.part.responses.push_back(problem.responses[i]);
                }
            }
            cluster.newton.prepare(cluster.part);
        }
        return clusters;
    }

    // The cluster's rows, from the present velocities less what these rows gave to them.
    // `alone`: it is the whole island.
    void solve(Cluster<S>& cluster, bool alone, const Problem<S>& problem, RowSystem<S>& system) const {
        RowSystem<S>& own = cluster.newton.system;
        for (std::size_t n = 0; n < cluster.bodies.size(); ++n) {
            own.v[n] = system.v[cluster.bodies[n]];
        }
        for (std::size_t m = 0; m < cluster.blocks.size(); ++m) {
            const RowBlock<S>& block = cluster.part.blocks[m];
            const std::size_t from = static_cast<std::size_t>(problem.blocks[cluster.blocks[m]].first);
            // A contact that the sweeps leave alone carries nothing.
            const bool idle = block.kind == BlockKind::Contact && !(system.terms[from].delassus > S(0));
            own.friction[m] = idle ? S(-1) : system.friction[cluster.blocks[m]];
            for (std::size_t r = 0; r < static_cast<std::size_t>(block.count); ++r) {
                const std::size_t i = static_cast<std::size_t>(block.first) + r;
                own.terms[i] = system.terms[from + r];
                if (idle) {
                    own.terms[i].lo = own.terms[i].hi = S(0);
                }
                own.p[i] = system.p[from + r];
                own.push(cluster.part, i, block, -own.p[i]);
            }
        }
        cluster.newton.vStar = own.v;
        NewtonOptions options;
        // Loosely where there are others: the next visit goes on from here, and the border changes by more. 1e-8 m/s
        // from a regularisation of 1e-4 takes four times as long on a wall of 78 boxes, which then sags twice as far.
        options.regularisation = alone ? 1e-4 : 1e-2;
        options.minRegularisation = 1e-9;
        options.tolerance = !alone ? 1e-4 : std::is_same_v<S, double> ? 1e-8 : 1e-5;
        options.stalled = 10 * options.tolerance;
        options.deSaxceTolerance = 1;
        options.maxDeSaxceUpdates = 0;
        options.maxIterations = 20;
        // Impulses of a problem that is not solved answer velocities that are not its own: sweeps instead.
        if (!cluster.newton.solve(cluster.part, options).converged) {
            cluster.newton.runFallbackSweeps(cluster.part, 4);
        }
        system.visits += own.visits;
        system.blockProducts += own.blockProducts;
        own.visits = 0;
        own.blockProducts = 0;
        for (std::size_t n = 0; n < cluster.bodies.size(); ++n) {
            system.v[cluster.bodies[n]] = own.v[n];
        }
        for (std::size_t m = 0; m < cluster.blocks.size(); ++m) {
            const RowBlock<S>& block = cluster.part.blocks[m];
            const std::size_t to = static_cast<std::size_t>(problem.blocks[cluster.blocks[m]].first);
            for (std::size_t r = 0; r < static_cast<std::size_t>(block.count); ++r) {
                system.p[to + r] = own.p[static_cast<std::size_t>(block.first) + r];
            }
        }
    }

    int size_;
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeCluster(const SolverSettings& settings) {
    return std::make_unique<ClusterSolver<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeCluster(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeCluster(const SolverSettings&);

}  // namespace cairn
