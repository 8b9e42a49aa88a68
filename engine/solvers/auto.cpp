#include <cairn/engine/solvers/auto.hpp>

namespace cairn {

template <class S>
Auto<S>::Auto(const SolverSettings& settings)
    : settings_(settings),
      direct_(std::make_unique<Direct<S>>(settings)),
      gaussSeidel_(std::make_unique<GaussSeidel<S>>(settings)) {}

template <class S>
bool Auto<S>::takesDirect(const Island<S>& island) const {
    const double bound = settings_.def.directWork > 0 ? settings_.def.directWork : 1e6;
    return direct_->predictWork(const_cast<Island<S>&>(island)) <= bound;
}

template <class S>
int Auto<S>::substeps(const Island<S>& island, S dt) const {
    return takesDirect(island) ? direct_->substeps(island, dt) : gaussSeidel_->substeps(island, dt);
}

template <class S>
SolveReport Auto<S>::advance(Island<S>& island, S h) {
    return takesDirect(island) ? direct_->advance(island, h) : gaussSeidel_->advance(island, h);
}

template class Auto<float>;
template class Auto<double>;

}  // namespace cairn
