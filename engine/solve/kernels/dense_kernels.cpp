#include "engine/solve/kernels/dense_kernels.hpp"
#include "base/vector_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/solve/kernels/dense_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace cairn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<double, 8>;

// A tile of out stays in registers while all of `inner` is summed. fromZero: out is not read, and taken for zero.
template <std::size_t tileRows, std::size_t tileVectors, bool fromZero>
HWY_INLINE void subtractTile(DenseRows out, DenseView left, DenseRows right, std::size_t inner) {
    const Lanes d;
    const std::size_t width = hn::Lanes(d);
    hn::Vec<Lanes> sum[tileRows][tileVectors];
    for (std::size_t r = 0; r < tileRows; ++r) {
        for (std::size_t v = 0; v < tileVectors; ++v) {
            sum[r][v] = fromZero ? hn::Zero(d) : hn::LoadU(d, out.at + r * out.rowStep + v * width);
        }
    }
    for (std::size_t l = 0; l < inner; ++l) {
        hn::Vec<Lanes> from[tileVectors];
        for (std::size_t v = 0; v < tileVectors; ++v) {
            from[v] = hn::LoadU(d, right.at + l * right.rowStep + v * width);
        }
        for (std::size_t r = 0; r < tileRows; ++r) {
            const auto share = hn::Set(d, left.at[r * left.rowStep + l * left.columnStep]);
            for (std::size_t v = 0; v < tileVectors; ++v) {
                sum[r][v] = hn::Sub(sum[r][v], hn::Mul(share, from[v]));
            }
        }
    }
    for (std::size_t r = 0; r < tileRows; ++r) {
        for (std::size_t v = 0; v < tileVectors; ++v) {
            hn::StoreU(sum[r][v], d, out.at + r * out.rowStep + v * width);
        }
    }
}

template <std::size_t tileRows, bool fromZero>
HWY_INLINE void subtractRows(DenseRows out, DenseView left, DenseRows right, std::size_t inner, std::size_t columns) {
    const std::size_t width = hn::Lanes(Lanes());
    std::size_t c = 0;
    // As many sums at once as keep both units busy.
    constexpr std::size_t wide = 8 / tileRows;
    for (; wide > 2 && c + wide * width <= columns; c += wide * width) {
        subtractTile<tileRows, wide, fromZero>({out.at + c, out.rowStep}, left, {right.at + c, right.rowStep}, inner);
    }
    for (; wide > 4 && c + 4 * width <= columns; c += 4 * width) {
        subtractTile<tileRows, 4, fromZero>({out.at + c, out.rowStep}, left, {right.at + c, right.rowStep}, inner);
    }
    for (; c + 2 * width <= columns; c += 2 * width) {
        subtractTile<tileRows, 2, fromZero>({out.at + c, out.rowStep}, left, {right.at + c, right.rowStep}, inner);
    }
    for (; c + width <= columns; c += width) {
        subtractTile<tileRows, 1, fromZero>({out.at + c, out.rowStep}, left, {right.at + c, right.rowStep}, inner);
    }
    for (; c < columns; ++c) {
        for (std::size_t r = 0; r < tileRows; ++r) {
            double sum = fromZero ? 0.0 : out.at[r * out.rowStep + c];
            for (std::size_t l = 0; l < inner; ++l) {
                sum -= left.at[r * left.rowStep + l * left.columnStep] * right.at[l * right.rowStep + c];
            }
            out.at[r * out.rowStep + c] = sum;
        }
    }
}

template <bool fromZero>
void subtractOf(DenseRows out, DenseView left, DenseRows right, std::size_t rows, std::size_t inner,
                std::size_t columns) {
    constexpr std::size_t tile = 4;
    std::size_t r = 0;
    for (; r + tile <= rows; r += tile) {
        subtractRows<tile, fromZero>({out.at + r * out.rowStep, out.rowStep},
                                     {left.at + r * left.rowStep, left.rowStep, left.columnStep}, right, inner,
                                     columns);
    }
    for (; r < rows; ++r) {
        subtractRows<1, fromZero>({out.at + r * out.rowStep, out.rowStep},
                                  {left.at + r * left.rowStep, left.rowStep, left.columnStep}, right, inner, columns);
    }
}

// `count` rows at once.
template <std::size_t count>
HWY_INLINE void subtractDotsOf(double* out, DenseRows matrix, const double* x, std::size_t columns) {
    constexpr std::size_t sums = 8;
    const Lanes d;
    const std::size_t width = hn::Lanes(d);
    double sum[count][sums] = {};
    std::size_t c = 0;
    for (std::size_t part = 0; part < sums; part += width) {
        hn::Vec<Lanes> lanes[count];
        for (std::size_t r = 0; r < count; ++r) {
            lanes[r] = hn::Zero(d);
        }
        for (c = 0; c + sums <= columns; c += sums) {
            const auto shared = hn::LoadU(d, x + c + part);
            for (std::size_t r = 0; r < count; ++r) {
                lanes[r] = hn::Add(lanes[r], hn::Mul(hn::LoadU(d, matrix.at + r * matrix.rowStep + c + part), shared));
            }
        }
        for (std::size_t r = 0; r < count; ++r) {
            hn::StoreU(lanes[r], d, sum[r] + part);
        }
    }
    for (std::size_t r = 0; r < count; ++r) {
        double* s = sum[r];
        for (std::size_t k = c; k < columns; ++k) {
            s[k - c] += matrix.at[r * matrix.rowStep + k] * x[k];
        }
        out[r] -= ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }
}

void subtractDots(double* out, DenseRows matrix, const double* x, std::size_t rows, std::size_t columns) {
    constexpr std::size_t tile = 4;
    std::size_t r = 0;
    for (; r + tile <= rows; r += tile) {
        subtractDotsOf<tile>(out + r, {matrix.at + r * matrix.rowStep, matrix.rowStep}, x, columns);
    }
    for (; r < rows; ++r) {
        subtractDotsOf<1>(out + r, {matrix.at + r * matrix.rowStep, matrix.rowStep}, x, columns);
    }
}

DenseKernels kernels() {
    return {hwy::TargetName(HWY_TARGET), subtractOf<false>, subtractOf<true>, subtractDots};
}

}  // namespace HWY_NAMESPACE
}  // namespace cairn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace cairn {
namespace {

HWY_EXPORT(kernels);

DenseKernels chosen() {
    return HWY_DYNAMIC_DISPATCH(kernels)();
}

}  // namespace

const DenseKernels& denseKernels() {
    static const DenseKernels kernels = chosen();
    return kernels;
}

std::vector<DenseKernels> allDenseKernels() {
    return ofEachTarget(chosen);
}

}  // namespace cairn
#endif
