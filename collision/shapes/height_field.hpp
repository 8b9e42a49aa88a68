#pragma once
// A grid of heights as static ground: two triangles a cell, found by their place without a tree. A height that is not a
// number (NaN) is a hole: the triangles that meet there are left out.
#include <cairn/shapes.hpp>

#include "base/function_ref.hpp"

namespace cairn {

class HeightField {
public:
    // heights: row after row, `columns` each; m along y. Columns run along +x, rows along +z, `cellSize` m apart, the
    // grid centred on the shape's origin. Throws InputError for fewer than two columns or rows, a number of heights
    // that is not their product, an infinite height, a cell under minShapeSize(), or holes only.
    HeightField(int columns, int rows, std::vector<double> heights, double cellSize);

    int columns() const { return columns_; }
    int rows() const { return rows_; }
    double cellSize() const { return cell_; }
    double height(int column, int row) const { return heights_[at(column, row)]; }
    const std::vector<double>& heights() const { return heights_; }
    const Aabb& bounds() const { return bounds_; }  // shape frame

    // Triangle 2 i and 2 i + 1 are of cell i = row * (columns - 1) + column; vertex ids are row * columns + column.
    int triangleCount() const { return 2 * (columns_ - 1) * (rows_ - 1); }
    bool isThere(int triangle) const;
    std::array<int, 3> vertices(int triangle) const;
    Vec3d vertex(int id) const;
    // Bit k: edge k can be touched from a side, see CollisionMesh.
    unsigned activeEdges(int triangle) const;
    unsigned sharpCorners(int triangle) const;  // bit k: an active edge, of any triangle, ends at corner k
    // The height above (x, z), m, shape frame: NaN over holes and beyond the grid.
    double heightAt(double x, double z) const;

    // Appends the triangles whose boxes overlap `region` (shape frame), in rising order. Thread-safe.
    void find(const Aabb& region, std::vector<int>& out) const;
    // Calls visit(triangle, limit) for the triangles that a box of these half extents may meet on its way from `origin`
    // to origin + limit * motion, along the way; visit answers the new limit. Thread-safe.
    void castBox(const Vec3d& origin, const Vec3d& motion, const Vec3d& halfExtents, double limit,
                 FunctionRef<double(int, double)> visit) const;

private:
    std::size_t at(int column, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
    }
    double low(int column, int row) const;  // of a cell, over the heights that are there
    double high(int column, int row) const;

    int columns_;
    int rows_;
    double cell_;
    std::vector<double> heights_;
    std::vector<std::uint8_t> active_;  // by cell: 3 bits a triangle
    std::vector<bool> isSharp_;         // by vertex id
    // Tiles of `tileCells` cells a side with their least and greatest height; least > greatest: nothing there.
    int tilesX_ = 0;
    std::vector<std::array<double, 2>> tiles_;
    Aabb bounds_;
};

}  // namespace cairn
