#pragma once
// Matrices of any size for tests. Their sums, products and solutions are computed at once, by functions that are
// compiled once: Eigen's own make a new type of every formula, for which a compiler takes a minute a file.
#include <Eigen/Core>

namespace cairn {

class DenseVector : public Eigen::VectorXd {
public:
    using Eigen::VectorXd::VectorXd;

    double norm() const;
    double dot(const DenseVector& other) const;
    DenseVector cwiseProduct(const DenseVector& other) const;
    DenseVector cwiseQuotient(const DenseVector& other) const;
};

class Dense : public Eigen::MatrixXd {
public:
    using Eigen::MatrixXd::MatrixXd;

    Dense transpose() const;
    DenseVector diagonal() const;
};
Dense diagonalMatrix(const DenseVector& diagonal);

DenseVector operator-(const DenseVector& a);
DenseVector operator+(const DenseVector& a, const DenseVector& b);
DenseVector operator-(const DenseVector& a, const DenseVector& b);
DenseVector operator*(double a, const DenseVector& b);
DenseVector operator*(const DenseVector& a, double b);
DenseVector operator/(const DenseVector& a, double b);
Dense operator-(const Dense& a);
Dense operator+(const Dense& a, const Dense& b);
Dense operator-(const Dense& a, const Dense& b);
Dense operator*(double a, const Dense& b);
Dense operator*(const Dense& a, double b);
Dense operator/(const Dense& a, double b);
Dense operator*(const Dense& a, const Dense& b);
DenseVector operator*(const Dense& a, const DenseVector& b);

// x of A x = b, for an A that is symmetric, and for any.
DenseVector solveLdlt(const Dense& A, const DenseVector& b);
DenseVector solveLu(const Dense& A, const DenseVector& b);
Dense solveLu(const Dense& A, const Dense& b);

// Largest magnitude of an eigenvalue, by Gelfand's formula: |G^n|^(1/n), where squaring has made n endless.
double spectralRadius(const Dense& G);
// Of a symmetric matrix, in rising order.
DenseVector symmetricEigenvalues(const Dense& A);
// A^+ b of a symmetric matrix.
DenseVector timesPseudoInverse(const Dense& A, const DenseVector& b);

}  // namespace cairn
