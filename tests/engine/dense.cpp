#include "tests/engine/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <cmath>

namespace cairn {

namespace {

// As Eigen has them, for its own operators.
const Eigen::VectorXd& own(const DenseVector& a) {
    return a;
}
const Eigen::MatrixXd& own(const Dense& a) {
    return a;
}

}  // namespace

double DenseVector::norm() const {
    return own(*this).norm();
}
double DenseVector::dot(const DenseVector& other) const {
    return own(*this).dot(own(other));
}
DenseVector DenseVector::cwiseProduct(const DenseVector& other) const {
    return own(*this).cwiseProduct(own(other));
}
DenseVector DenseVector::cwiseQuotient(const DenseVector& other) const {
    return own(*this).cwiseQuotient(own(other));
}

Dense Dense::transpose() const {
    return own(*this).transpose();
}
DenseVector Dense::diagonal() const {
    return own(*this).diagonal();
}
Dense diagonalMatrix(const DenseVector& diagonal) {
    return Dense(own(diagonal).asDiagonal());
}

DenseVector operator-(const DenseVector& a) {
    return -own(a);
}
DenseVector operator+(const DenseVector& a, const DenseVector& b) {
    return own(a) + own(b);
}
DenseVector operator-(const DenseVector& a, const DenseVector& b) {
    return own(a) - own(b);
}
DenseVector operator*(double a, const DenseVector& b) {
    return a * own(b);
}
DenseVector operator*(const DenseVector& a, double b) {
    return own(a) * b;
}
DenseVector operator/(const DenseVector& a, double b) {
    return own(a) / b;
}
Dense operator-(const Dense& a) {
    return -own(a);
}
Dense operator+(const Dense& a, const Dense& b) {
    return own(a) + own(b);
}
Dense operator-(const Dense& a, const Dense& b) {
    return own(a) - own(b);
}
Dense operator*(double a, const Dense& b) {
    return a * own(b);
}
Dense operator*(const Dense& a, double b) {
    return own(a) * b;
}
Dense operator/(const Dense& a, double b) {
    return own(a) / b;
}
Dense operator*(const Dense& a, const Dense& b) {
    return own(a) * own(b);
}
DenseVector operator*(const Dense& a, const DenseVector& b) {
    return own(a) * own(b);
}

DenseVector solveLdlt(const Dense& A, const DenseVector& b) {
    return own(A).ldlt().solve(own(b));
}
DenseVector solveLu(const Dense& A, const DenseVector& b) {
    return own(A).lu().solve(own(b));
}
Dense solveLu(const Dense& A, const Dense& b) {
    return own(A).lu().solve(own(b));
}

double spectralRadius(const Dense& G) {
    Eigen::MatrixXd power = G;
    double logarithm = 0;
    for (double share = 1; share > 1e-16; share /= 2) {
        const double size = power.norm();
        if (size == 0) {
            return 0;
        }
        logarithm += share * std::log(size);
        power /= size;
        power = power * power;
    }
    return std::exp(logarithm);
}
DenseVector symmetricEigenvalues(const Dense& A) {
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A).eigenvalues();
}
DenseVector timesPseudoInverse(const Dense& A, const DenseVector& b) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A);
    Eigen::VectorXd along = eigen.eigenvectors().transpose() * own(b);
    for (Eigen::Index i = 0; i < along.size(); ++i) {
        const double value = eigen.eigenvalues()(i);
        along(i) = value > 1e-11 * eigen.eigenvalues()(along.size() - 1) ? along(i) / value : 0;
    }
    return eigen.eigenvectors() * along;
}

}  // namespace cairn
