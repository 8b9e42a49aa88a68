#include "engine/solve/kernels/dense_kernels.hpp"
#include "base/vector_targets.hpp"

#include <algorithm>
#include <type_traits>

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
HWY_INLINE void subtractBlock(DenseRows out, DenseView left, DenseRows right, std::size_t rows, std::size_t inner,
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

// In blocks of `right` that stay in the first cache, packed, while all rows are summed: sums go on where the last block
// left them.
template <bool fromZero>
void subtractOf(DenseRows out, DenseView left, DenseRows right, std::size_t rows, std::size_t inner,
                std::size_t columns) {
    constexpr std::size_t deep = 64;
    constexpr std::size_t wide = 48;
    constexpr std::size_t worthPacking = 24;  // of `inner` and `rows`
    if (inner < worthPacking || rows < worthPacking) {
        subtractBlock<fromZero>(out, left, right, rows, inner, columns);
        return;
    }
    alignas(64) double room[deep * wide];
    const DenseRows packed{room, wide};
    for (std::size_t c = 0; c < columns; c += wide) {
        const std::size_t width = std::min(wide, columns - c);
        const DenseRows to{out.at + c, out.rowStep};
        for (std::size_t l = 0; l < inner; l += deep) {
            const std::size_t depth = std::min(deep, inner - l);
            for (std::size_t k = 0; k < depth; ++k) {
                std::copy_n(right.at + (l + k) * right.rowStep + c, width, room + k * wide);
            }
            const DenseView from{left.at + l * left.columnStep, left.rowStep, left.columnStep};
            if (fromZero && l == 0) {
                subtractBlock<true>(to, from, packed, rows, depth, width);
            } else {
                subtractBlock<false>(to, from, packed, rows, depth, width);
            }
        }
    }
}

// The columns of `term` lie side by side.
void add(DenseRows out, DenseView term, std::size_t rows, std::size_t columns) {
    const Lanes d;
    const std::size_t width = hn::Lanes(d);
    for (std::size_t r = 0; r < rows; ++r) {
        double* to = out.at + r * out.rowStep;
        const double* from = term.at + r * term.rowStep;
        std::size_t c = 0;
        for (; c + width <= columns; c += width) {
            hn::StoreU(hn::Add(hn::LoadU(d, to + c), hn::LoadU(d, from + c)), d, to + c);
        }
        for (; c < columns; ++c) {
            to[c] += from[c];
        }
    }
}

// `count` rows at once.
template <std::size_t count>
HWY_INLINE void subtractDotsOf(double* out, DenseRows matrix, const double* x, std::size_t columns) {
    constexpr std::size_t sums = 8;
    constexpr std::size_t width = hn::MaxLanes(Lanes());
    constexpr std::size_t parts = sums / width;
    const Lanes d;
    hn::Vec<Lanes> lanes[count][parts];
    for (std::size_t r = 0; r < count; ++r) {
        for (std::size_t part = 0; part < parts; ++part) {
            lanes[r][part] = hn::Zero(d);
        }
    }
    std::size_t c = 0;
    for (; c + sums <= columns; c += sums) {
        for (std::size_t part = 0; part < parts; ++part) {
            const auto shared = hn::LoadU(d, x + c + part * width);
            for (std::size_t r = 0; r < count; ++r) {
                const auto row = hn::LoadU(d, matrix.at + r * matrix.rowStep + c + part * width);
                lanes[r][part] = hn::Add(lanes[r][part], hn::Mul(row, shared));
            }
        }
    }
    for (std::size_t r = 0; r < count; ++r) {
        double s[sums];
        for (std::size_t part = 0; part < parts; ++part) {
            hn::StoreU(lanes[r][part], d, s + part * width);
        }
        for (std::size_t k = c; k < columns; ++k) {
            s[k - c] += matrix.at[r * matrix.rowStep + k] * x[k];
        }
        out[r] -= ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }
}

void subtractDots(double* out, DenseRows matrix, const double* x, std::size_t rows, std::size_t columns) {
    std::size_t r = 0;
    const auto take = [&](auto count) {
        for (; r + count <= rows; r += count) {
            subtractDotsOf<count>(out + r, {matrix.at + r * matrix.rowStep, matrix.rowStep}, x, columns);
        }
    };
    if constexpr (hn::MaxLanes(Lanes()) >= 4) {
        take(std::integral_constant<std::size_t, 4>());
    }
    take(std::integral_constant<std::size_t, 2>());
    take(std::integral_constant<std::size_t, 1>());
}

DenseKernels kernels() {
    return {hwy::TargetName(HWY_TARGET), subtractOf<false>, subtractOf<true>, add, subtractDots};
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
