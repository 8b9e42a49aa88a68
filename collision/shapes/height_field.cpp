#include "collision/shapes/height_field.hpp"
#include "base/base.hpp"
#include "collision/shapes/box_walk.hpp"
#include "collision/shapes/constants.hpp"

#include <cmath>
#include <limits>

namespace cairn {

namespace {

// Cells along a side of a tile: 64 cells share one pair of heights, 2 % of the memory of the heights.
constexpr int tileCells = 8;

// Squares of a grid, by their number along x and z.
struct Squares {
    double x;  // of the lower corner of square 0, 0
    double z;
    double size;
    int fromX, toX;  // the squares asked for, both ends included
    int fromZ, toZ;
};

int clampedCell(double place, int from, int to) {
    return static_cast<int>(std::clamp(std::floor(place), static_cast<double>(from), static_cast<double>(to)));
}

// Calls f(ix, iz) for the squares that a moving box may meet seen from above, in the order of the motion.
template <class F>
void alongMotion(const Squares& s, const Vec3d& origin, const Vec3d& motion, const Vec3d& half, const double& limit,
                 F f) {
    const bool rightward = motion.x() >= 0;
    const bool forward = motion.z() >= 0;
    for (int stepX = 0; stepX <= s.toX - s.fromX; ++stepX) {
        const int ix = rightward ? s.fromX + stepX : s.toX - stepX;
        const double low = s.x + ix * s.size - half.x() - origin.x();
        const double high = s.x + (ix + 1) * s.size + half.x() - origin.x();
        double t0 = 0;
        double t1 = limit;
        if (motion.x() != 0) {
            t0 = std::max(t0, (rightward ? low : high) / motion.x());
            t1 = std::min(t1, (rightward ? high : low) / motion.x());
        } else if (low > 0 || high < 0) {
            continue;
        }
        if (t0 > t1 * (1 + 1e-12)) {
            if (t0 > limit) {
                return;
            }
            continue;
        }
        double z0 = origin.z();
        double z1 = origin.z();
        if (motion.z() != 0) {
            z0 += motion.z() * t0;
            z1 += motion.z() * t1;
        }
        // A little more than the row of squares met, as rounding may have it.
        const double spare = 1e-9 * s.size;
        const int first = clampedCell((std::min(z0, z1) - half.z() - s.z - spare) / s.size, s.fromZ, s.toZ + 1);
        const int last = clampedCell((std::max(z0, z1) + half.z() - s.z + spare) / s.size, s.fromZ - 1, s.toZ);
        for (int stepZ = 0; stepZ <= last - first; ++stepZ) {
            f(ix, forward ? first + stepZ : last - stepZ);
        }
    }
}

std::string text(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%g", value);
    return buffer;
}

void requireGrid(int columns, int rows, const std::vector<double>& heights, double cellSize) {
    if (columns < 2 || rows < 2 || columns > 30000 || rows > 30000) {
        throw InputError("heightfield", std::to_string(rows) + " rows of " + std::to_string(columns),
                         "give at least two rows of at least two heights, and no more than 30000 of either");
    }
    if (heights.size() != static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {
        throw InputError("heightfield.heights", std::to_string(heights.size()) + " of them",
                         "give " + std::to_string(columns) + " for each of the " + std::to_string(rows) + " rows");
    }
    if (!std::isfinite(cellSize) || cellSize < minShapeSize()) {
        throw InputError("heightfield.cellSize", text(cellSize), "give at least " + text(minShapeSize()) + " m");
    }
    for (std::size_t i = 0; i < heights.size(); ++i) {
        if (std::isinf(heights[i])) {
            throw InputError("heightfield.heights[" + std::to_string(i) + "]", text(heights[i]),
                             "give a finite height in m, or NaN for a hole");
        }
    }
}

// The triangle across an edge, or -1.
int across(int triangle, int edge, int cellsX, int cellsZ) {
    const int cell = triangle / 2;
    const int column = cell % cellsX;
    const int row = cell / cellsX;
    const bool second = triangle % 2 == 1;
    if (second ? edge == 0 : edge == 1) {
        return second ? triangle - 1 : triangle + 1;
    }
    if (!second) {
        return edge == 0 ? (column > 0 ? triangle - 1 : -1) : (row > 0 ? triangle - 2 * cellsX + 1 : -1);
    }
    return edge == 1 ? (row + 1 < cellsZ ? triangle + 2 * cellsX - 1 : -1) : (column + 1 < cellsX ? triangle + 1 : -1);
}

}  // namespace

HeightField::HeightField(int columns, int rows, std::vector<double> heights, double cellSize)
    : columns_(columns), rows_(rows), cell_(cellSize), heights_(std::move(heights)) {
    requireGrid(columns, rows, heights_, cellSize);
    const int cellsX = columns_ - 1;
    const int cellsZ = rows_ - 1;
    tilesX_ = (cellsX + tileCells - 1) / tileCells;
    const int tilesZ = (cellsZ + tileCells - 1) / tileCells;
    tiles_.assign(static_cast<std::size_t>(tilesX_) * static_cast<std::size_t>(tilesZ), {infinity, -infinity});
    bounds_ = {Vec3d::Constant(infinity), Vec3d::Constant(-infinity)};
    bool any = false;
    for (int triangle = 0; triangle < triangleCount(); ++triangle) {
        if (!isThere(triangle)) {
            continue;
        }
        any = true;
        const int cell = triangle / 2;
        auto& tile = tiles_[static_cast<std::size_t>(cell / cellsX / tileCells) * static_cast<std::size_t>(tilesX_) +
                            static_cast<std::size_t>(cell % cellsX / tileCells)];
        for (const int id : vertices(triangle)) {
            const Vec3d p = vertex(id);
            bounds_ = {bounds_.min.cwiseMin(p), bounds_.max.cwiseMax(p)};
            tile = {std::min(tile[0], p.y()), std::max(tile[1], p.y())};
        }
    }
    if (!any) {
        throw InputError("heightfield.heights", "holes only", "give at least three neighbouring heights");
    }

    const auto normal = [&](int triangle) {
        const auto v = vertices(triangle);
        const Vec3d origin = vertex(v[0]);
        return Vec3d((vertex(v[1]) - origin).cross(vertex(v[2]) - origin).normalized());
    };
    isSharp_.assign(heights_.size(), false);
    active_.assign(static_cast<std::size_t>(cellsX) * static_cast<std::size_t>(cellsZ), 0);
    for (int triangle = 0; triangle < triangleCount(); ++triangle) {
        if (!isThere(triangle)) {
            continue;
        }
        const Vec3d n = normal(triangle);
        const auto v = vertices(triangle);
        for (int edge = 0; edge < 3; ++edge) {
            const int other = across(triangle, edge, cellsX, cellsZ);
            bool isActive = true;
            if (other >= 0 && isThere(other)) {
                const Vec3d onEdge = vertex(v[static_cast<std::size_t>(edge)]);
                const Vec3d m = normal(other);
                // The other's corners on the edge add only round-off, so that the sum is of the one beyond it.
                double rise = 0;
                for (const int id : vertices(other)) {
                    rise += n.dot(vertex(id) - onEdge);
                }
                isActive = rise <= 1e-9 * cell_ && n.dot(m) <= cosFlat;
            }
            if (isActive) {
                active_[static_cast<std::size_t>(triangle / 2)] |=
                    static_cast<std::uint8_t>(1u << static_cast<unsigned>(3 * (triangle % 2) + edge));
                isSharp_[static_cast<std::size_t>(v[static_cast<std::size_t>(edge)])] = true;
                isSharp_[static_cast<std::size_t>(v[static_cast<std::size_t>((edge + 1) % 3)])] = true;
            }
        }
    }
}

bool HeightField::isThere(int triangle) const {
    for (const int id : vertices(triangle)) {
        if (std::isnan(heights_[static_cast<std::size_t>(id)])) {
            return false;
        }
    }
    return true;
}

std::array<int, 3> HeightField::vertices(int triangle) const {
    const int cell = triangle / 2;
    const int corner = cell / (columns_ - 1) * columns_ + cell % (columns_ - 1);
    const int right = corner + 1;
    const int below = corner + columns_;
    return triangle % 2 == 0 ? std::array{corner, below, right} : std::array{right, below, below + 1};
}

Vec3d HeightField::vertex(int id) const {
    const int row = id / columns_;
    return {(id % columns_ - 0.5 * (columns_ - 1)) * cell_, heights_[static_cast<std::size_t>(id)],
            (row - 0.5 * (rows_ - 1)) * cell_};
}

unsigned HeightField::activeEdges(int triangle) const {
    return (active_[static_cast<std::size_t>(triangle / 2)] >> (3 * (triangle % 2))) & 7u;
}

unsigned HeightField::sharpCorners(int triangle) const {
    const auto v = vertices(triangle);
    unsigned sharp = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        sharp |= isSharp_[static_cast<std::size_t>(v[k])] ? 1u << k : 0u;
    }
    return sharp;
}

double HeightField::heightAt(double x, double z) const {
    const double u = x / cell_ + 0.5 * (columns_ - 1);
    const double v = z / cell_ + 0.5 * (rows_ - 1);
    if (!(u >= 0 && v >= 0 && u <= columns_ - 1 && v <= rows_ - 1)) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    const int column = std::min(static_cast<int>(u), columns_ - 2);
    const int row = std::min(static_cast<int>(v), rows_ - 2);
    const double s = u - column;
    const double t = v - row;
    const double right = height(column + 1, row);
    const double below = height(column, row + 1);
    if (s + t <= 1) {
        const double corner = height(column, row);
        return corner + s * (right - corner) + t * (below - corner);
    }
    const double far = height(column + 1, row + 1);
    return far + (1 - s) * (below - far) + (1 - t) * (right - far);
}

double HeightField::low(int column, int row) const {
    // fmin leaves NaN out.
    return std::fmin(std::fmin(height(column, row), height(column + 1, row)),
                     std::fmin(height(column, row + 1), height(column + 1, row + 1)));
}

double HeightField::high(int column, int row) const {
    return std::fmax(std::fmax(height(column, row), height(column + 1, row)),
                     std::fmax(height(column, row + 1), height(column + 1, row + 1)));
}

void HeightField::find(const Aabb& region, std::vector<int>& out) const {
    if (!bounds_.overlaps(region)) {
        return;
    }
    // A little wider, as rounding may have it; each triangle is asked for its own box in the end.
    const auto placeX = [&](double x) { return x / cell_ + 0.5 * (columns_ - 1); };
    const auto placeZ = [&](double z) { return z / cell_ + 0.5 * (rows_ - 1); };
    const int fromX = clampedCell(placeX(region.min.x()) - 1e-9, 0, columns_ - 2);
    const int toX = clampedCell(placeX(region.max.x()) + 1e-9, 0, columns_ - 2);
    const int fromZ = clampedCell(placeZ(region.min.z()) - 1e-9, 0, rows_ - 2);
    const int toZ = clampedCell(placeZ(region.max.z()) + 1e-9, 0, rows_ - 2);
    for (int row = fromZ; row <= toZ; ++row) {
        for (int column = fromX; column <= toX; ++column) {
            if (!(low(column, row) <= region.max.y()) || !(high(column, row) >= region.min.y())) {
                continue;
            }
            const int first = 2 * (row * (columns_ - 1) + column);
            for (const int triangle : {first, first + 1}) {
                if (!isThere(triangle)) {
                    continue;
                }
                const auto v = vertices(triangle);
                const Vec3d a = vertex(v[0]);
                const Vec3d b = vertex(v[1]);
                const Vec3d c = vertex(v[2]);
                if (Aabb{a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)}.overlaps(region)) {
                    out.push_back(triangle);
                }
            }
        }
    }
}

void HeightField::castBox(const Vec3d& origin, const Vec3d& motion, const Vec3d& half, double limit,
                          FunctionRef<double(int, double)> visit) const {
    const MovingBox moving(origin, motion, half);
    // Beyond the bounds nothing is met, so that a ray without end walks no farther.
    const double entry = moving.entry(bounds_.min, bounds_.max, limit);
    if (std::isinf(entry)) {
        return;
    }
    for (int i = 0; i < 3; ++i) {
        if (motion[i] != 0) {
            const double side = motion[i] > 0 ? bounds_.max[i] + half[i] : bounds_.min[i] - half[i];
            limit = std::min(limit, (side - origin[i]) / motion[i] * (1 + 1e-12) + 1e-300);
        }
    }
    const double x0 = -0.5 * (columns_ - 1) * cell_;
    const double z0 = -0.5 * (rows_ - 1) * cell_;
    const int tilesZ = static_cast<int>(tiles_.size()) / tilesX_;
    const Squares tiles{x0, z0, tileCells * cell_, 0, tilesX_ - 1, 0, tilesZ - 1};
    alongMotion(tiles, origin, motion, half, limit, [&](int tileX, int tileZ) {
        const auto& [lowest, highest] = tiles_[static_cast<std::size_t>(tileZ) * static_cast<std::size_t>(tilesX_) +
                                               static_cast<std::size_t>(tileX)];
        const auto corner = [&](int ix, double y, int iz) { return Vec3d(x0 + ix * cell_, y, z0 + iz * cell_); };
        const int fromX = tileX * tileCells;
        const int fromZ = tileZ * tileCells;
        if (!(lowest <= highest) ||
            std::isinf(moving.entry(corner(fromX, lowest, fromZ), corner(fromX + tileCells, highest, fromZ + tileCells),
                                    limit))) {
            return;
        }
        const Squares cells{x0,
                            z0,
                            cell_,
                            fromX,
                            std::min(fromX + tileCells, columns_ - 1) - 1,
                            fromZ,
                            std::min(fromZ + tileCells, rows_ - 1) - 1};
        alongMotion(cells, origin, motion, half, limit, [&](int column, int row) {
            const double bottom = low(column, row);
            if (std::isnan(bottom) || std::isinf(moving.entry(corner(column, bottom, row),
                                                              corner(column + 1, high(column, row), row + 1), limit))) {
                return;
            }
            const int first = 2 * (row * (columns_ - 1) + column);
            for (const int triangle : {first, first + 1}) {
                if (isThere(triangle)) {
                    limit = visit(triangle, limit);
                }
            }
        });
    });
}

}  // namespace cairn
