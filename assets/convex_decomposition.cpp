#include <cairn/assets/convex_decomposition.hpp>
#include <cairn/assets/convex_hull.hpp>
#include <cairn/shape_query.hpp>

#include "base/digits.hpp"
#include "collision/shapes/collision_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace cairn {

namespace {

// Cuts tried along each axis beside the mesh's own flat faces.
constexpr int evenCuts = 9;
constexpr std::size_t faceCuts = 8;
// Of the mesh's volume: what a cut must save to be chosen for it.
constexpr double gain = 5e-3;

double volumeOf(const TriangleMesh& mesh, const Vec3d& origin) {
    double volume = 0;
    for (const auto& t : mesh.triangles) {
        const auto at = [&](std::size_t k) -> Vec3d { return mesh.vertices[static_cast<std::size_t>(t[k])] - origin; };
        volume += at(0).dot(at(1).cross(at(2))) / 6;
    }
    return volume;
}

// The solid as cells, by the crossings of lines along y through the middles of the columns.
class Cells {
public:
    Cells(const TriangleMesh& mesh, const Aabb& box, int resolution) : low_(box.min) {
        size_ = (box.max - box.min).maxCoeff() / resolution;
        for (int i = 0; i < 3; ++i) {
            count_[static_cast<std::size_t>(i)] =
                std::max(1, static_cast<int>(std::ceil((box.max[i] - box.min[i]) / size_ - 1e-9)));
        }
        std::vector<std::vector<double>> crossings(static_cast<std::size_t>(count_[0]) *
                                                   static_cast<std::size_t>(count_[2]));
        for (const auto& t : mesh.triangles) {
            std::array<Vec3d, 3> c;
            for (std::size_t k = 0; k < 3; ++k) {
                c[k] = mesh.vertices[static_cast<std::size_t>(t[k])] - low_;
            }
            const Vec3d min = c[0].cwiseMin(c[1]).cwiseMin(c[2]);
            const Vec3d max = c[0].cwiseMax(c[1]).cwiseMax(c[2]);
            for (int i = cellOf(min.x(), 0); i <= cellOf(max.x(), 0); ++i) {
                for (int k = cellOf(min.z(), 2); k <= cellOf(max.z(), 2); ++k) {
                    // Off the middle by an odd little, so that a line runs through no edge of a regular mesh.
                    const double x = (i + 0.5 + 1.3e-7) * size_;
                    const double z = (k + 0.5 + 2.9e-7) * size_;
                    double area = 0;
                    double height = 0;
                    bool positive = true;
                    bool negative = true;
                    for (std::size_t e = 0; e < 3; ++e) {
                        const Vec3d& p = c[(e + 1) % 3];
                        const Vec3d& q = c[(e + 2) % 3];
                        const double w = (p.x() - x) * (q.z() - z) - (p.z() - z) * (q.x() - x);
                        positive = positive && w > 0;
                        negative = negative && w < 0;
                        area += w;
                        height += w * c[e].y();
                    }
                    if (positive || negative) {
                        crossings[column(i, k)].push_back(height / area);
                    }
                }
            }
        }
        solid_.assign(crossings.size() * static_cast<std::size_t>(count_[1]), 0);
        for (int i = 0; i < count_[0]; ++i) {
            for (int k = 0; k < count_[2]; ++k) {
                std::vector<double>& ys = crossings[column(i, k)];
                std::sort(ys.begin(), ys.end());
                for (std::size_t pair = 0; pair + 1 < ys.size(); pair += 2) {
                    for (int j = cellOf(ys[pair], 1); j <= cellOf(ys[pair + 1], 1); ++j) {
                        const double y = (j + 0.5) * size_;
                        if (y > ys[pair] && y < ys[pair + 1]) {
                            solid_[column(i, k) * static_cast<std::size_t>(count_[1]) + static_cast<std::size_t>(j)] =
                                1;
                        }
                    }
                }
            }
        }
    }

    double size() const { return size_; }

    // Of the solid within a box.
    double volume(const Aabb& box) const {
        std::size_t cells = 0;
        visit(box, [&](int, int, int) { ++cells; });
        return static_cast<double>(cells) * size_ * size_ * size_;
    }

    // The corners of the cells within a box, the lowest and highest over each place, held to the box.
    std::vector<Vec3d> corners(const Aabb& box) const {
        const auto width = static_cast<std::size_t>(count_[0] + 1);
        const auto depth = static_cast<std::size_t>(count_[2] + 1);
        std::vector<std::array<int, 2>> ends(width * depth, {std::numeric_limits<int>::max(), -1});
        visit(box, [&](int i, int j, int k) {
            for (const int di : {0, 1}) {
                for (const int dk : {0, 1}) {
                    auto& end = ends[static_cast<std::size_t>(i + di) * depth + static_cast<std::size_t>(k + dk)];
                    end = {std::min(end[0], j), std::max(end[1], j + 1)};
                }
            }
        });
        std::vector<Vec3d> points;
        for (std::size_t at = 0; at < ends.size(); ++at) {
            if (ends[at][1] < 0) {
                continue;
            }
            for (const int j : ends[at]) {
                const auto row = at / depth;
                const Vec3d p = low_ + size_ * Vec3d(static_cast<double>(row), j, static_cast<double>(at % depth));
                points.push_back(p.cwiseMax(box.min).cwiseMin(box.max));
            }
        }
        return points;
    }

private:
    int cellOf(double place, int axis) const {
        return std::clamp(static_cast<int>(std::floor(place / size_)), 0, count_[static_cast<std::size_t>(axis)] - 1);
    }
    std::size_t column(int i, int k) const {
        return static_cast<std::size_t>(i) * static_cast<std::size_t>(count_[2]) + static_cast<std::size_t>(k);
    }
    // Cells belong to a box by their middles.
    template <class F>
    void visit(const Aabb& box, F f) const {
        std::array<int, 3> from{};
        std::array<int, 3> to{};
        for (std::size_t a = 0; a < 3; ++a) {
            const auto i = static_cast<Eigen::Index>(a);
            from[a] = std::max(0, static_cast<int>(std::ceil((box.min[i] - low_[i]) / size_ - 0.5)));
            to[a] = std::min(count_[a], static_cast<int>(std::ceil((box.max[i] - low_[i]) / size_ - 0.5)));
        }
        for (int i = from[0]; i < to[0]; ++i) {
            for (int k = from[2]; k < to[2]; ++k) {
                for (int j = from[1]; j < to[1]; ++j) {
                    if (solid_[column(i, k) * static_cast<std::size_t>(count_[1]) + static_cast<std::size_t>(j)] != 0) {
                        f(i, j, k);
                    }
                }
            }
        }
    }

    Vec3d low_;
    double size_;
    std::array<int, 3> count_{};
    std::vector<std::uint8_t> solid_;
};

// The corners of the solid's part in a box: its triangles cut by the box, and the box's corners that are inside.
std::vector<Vec3d> cornersOfPart(const TriangleMesh& mesh, const Shape& solid, const Aabb& box) {
    std::vector<Vec3d> points;
    std::vector<Vec3d> loop;
    std::vector<Vec3d> cut;
    const double tolerance = 1e-9 * (box.max - box.min).norm();
    for (const auto& t : mesh.triangles) {
        loop.clear();
        for (const int index : t) {
            loop.push_back(mesh.vertices[static_cast<std::size_t>(index)]);
        }
        for (int side = 0; side < 6 && !loop.empty(); ++side) {
            const int axis = side / 2;
            const double sign = side % 2 == 0 ? 1 : -1;
            const double plane = side % 2 == 0 ? box.max[axis] : box.min[axis];
            cut.clear();
            // What only touches the side belongs to the part beyond it, or has neighbours that reach in.
            if (std::ranges::all_of(loop, [&](const Vec3d& p) { return sign * (p[axis] - plane) >= -tolerance; })) {
                loop.clear();
                break;
            }
            for (std::size_t k = 0; k < loop.size(); ++k) {
                const Vec3d& p = loop[k];
                const Vec3d& q = loop[(k + 1) % loop.size()];
                const double dp = sign * (p[axis] - plane);
                const double dq = sign * (q[axis] - plane);
                if (dp <= 0) {
                    cut.push_back(p);
                }
                if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) {
                    cut.push_back(p + (q - p) * (dp / (dp - dq)));
                    cut.back()[axis] = plane;
                }
            }
            std::swap(loop, cut);
        }
        points.insert(points.end(), loop.begin(), loop.end());
    }
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d p((corner & 1) != 0 ? box.max.x() : box.min.x(), (corner & 2) != 0 ? box.max.y() : box.min.y(),
                      (corner & 4) != 0 ? box.max.z() : box.min.z());
        // A little inside the box, as the corner itself may lie on the surface of what is beyond it.
        if (contains({&solid, 1}, {}, p + 1e-6 * (0.5 * (box.min + box.max) - p))) {
            points.push_back(p);
        }
    }
    return points;
}

// Heights of the mesh's flat faces across an axis, those with the most area first.
std::vector<double> flatFaces(const TriangleMesh& mesh, int axis, double closeness) {
    std::vector<std::pair<double, double>> planes;  // place, area
    for (const auto& t : mesh.triangles) {
        const auto at = [&](std::size_t k) -> const Vec3d& { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
        const Vec3d cross = (at(1) - at(0)).cross(at(2) - at(0));
        if (std::abs(cross[axis]) > 0.999 * cross.norm()) {
            planes.emplace_back(at(0)[axis], cross.norm());
        }
    }
    std::sort(planes.begin(), planes.end());
    std::vector<std::pair<double, double>> merged;  // area, place
    for (const auto& [place, area] : planes) {
        if (!merged.empty() && place - merged.back().second < closeness) {
            merged.back().first += area;
        } else {
            merged.emplace_back(area, place);
        }
    }
    std::sort(merged.begin(), merged.end(), std::greater<>());
    std::vector<double> places;
    places.reserve(merged.size());
    for (const auto& [area, place] : merged) {
        places.push_back(place);
    }
    return places;
}

struct Part {
    Aabb box;
    std::vector<Vec3d> points;
    double hull = 0;   // m3
    double solid = 0;  // m3

    double excess() const { return hull - solid; }
};

using FlatFaces = std::array<std::vector<double>, 3>;  // by axis, as flatFaces() sorts them

std::vector<double> cutsAcross(const Aabb& box, int axis, const FlatFaces& faces, double cell) {
    const double low = box.min[axis];
    const double high = box.max[axis];
    std::vector<double> cuts;
    for (int k = 1; k <= evenCuts; ++k) {
        cuts.push_back(low + (high - low) * k / (evenCuts + 1));
    }
    for (const double place : faces[static_cast<std::size_t>(axis)]) {
        if (place > low + 0.5 * cell && place < high - 0.5 * cell && cuts.size() < evenCuts + faceCuts) {
            cuts.push_back(place);
        }
    }
    return cuts;
}

// The two boxes of a part that leave the least hull, or its halves across the longest side where no single cut gains
// anything (a ring).
std::pair<Aabb, Aabb> bestCut(const Part& part, const Cells& cells, const FlatFaces& faces, double meshVolume) {
    int longest = 0;
    (part.box.max - part.box.min).maxCoeff(&longest);
    Aabb left = part.box;
    Aabb right = part.box;
    left.max[longest] = right.min[longest] = 0.5 * (left.min[longest] + left.max[longest]);
    double best = part.hull - gain * meshVolume;
    for (int axis = 0; axis < 3; ++axis) {
        for (const double place : cutsAcross(part.box, axis, faces, cells.size())) {
            Aabb a = part.box;
            Aabb b = part.box;
            a.max[axis] = place;
            b.min[axis] = place;
            const double both = convexHullVolume(cells.corners(a)) + convexHullVolume(cells.corners(b));
            if (both < best) {
                best = both;
                left = a;
                right = b;
            }
        }
    }
    return {left, right};
}

void requireRange(const char* field, double value, double min, double max) {
    if (!(value >= min && value <= max)) {
        throw InputError(std::string("decomposition.") + field, digits(value),
                         "give a number from " + digits(min) + " to " + digits(max));
    }
}

}  // namespace

Decomposition decompose(const TriangleMesh& given, const DecompositionDef& def) {
    requireRange("maxHulls", def.maxHulls, 1, 1024);
    requireRange("tolerance", def.tolerance, 0, 1e9);
    requireRange("resolution", def.resolution, 8, 256);
    const Shape solid = mesh(given);
    if (!solid.mesh->isClosed()) {
        throw InputError("mesh", "not closed", "close its surface, each edge between two triangles of one winding");
    }
    const TriangleMesh& triangles = solid.mesh->triangles();
    const Aabb box = solid.mesh->bounds();
    Decomposition out;
    out.meshVolume = volumeOf(triangles, 0.5 * (box.min + box.max));
    if (!(out.meshVolume > 1e-9 * (box.max - box.min).prod())) {
        throw InputError("mesh", "volume " + digits(out.meshVolume) + " m3",
                         "wind its triangles counter-clockwise seen from outside around a solid");
    }
    const Cells cells(triangles, box, def.resolution);
    FlatFaces faces;
    for (int axis = 0; axis < 3; ++axis) {
        faces[static_cast<std::size_t>(axis)] = flatFaces(triangles, axis, 1e-3 * cells.size());
    }
    // Cells know the volume to a few percent of a thin part; all parts together are scaled to the mesh's.
    const double scale = out.meshVolume / std::max(cells.volume(box), 1e-300);
    const auto makePart = [&](const Aabb& of) {
        Part part{of, cornersOfPart(triangles, solid, of)};
        part.hull = convexHullVolume(part.points);
        part.solid = scale * cells.volume(of);
        return part;
    };
    std::vector<Part> parts{makePart(box)};
    parts.front().solid = out.meshVolume;
    while (static_cast<int>(parts.size()) < def.maxHulls) {
        const double filled =
            std::accumulate(parts.begin(), parts.end(), 0.0, [](double sum, const Part& p) { return sum + p.hull; });
        if (filled - out.meshVolume <= def.tolerance * out.meshVolume) {
            break;
        }
        const auto worst = std::max_element(parts.begin(), parts.end(),
                                            [](const Part& a, const Part& b) { return a.excess() < b.excess(); });
        const auto [left, right] = bestCut(*worst, cells, faces, out.meshVolume);
        Part a = makePart(left);
        Part b = makePart(right);
        *worst = std::move(a);
        parts.push_back(std::move(b));
    }
    for (const Part& part : parts) {
        if (part.hull < 1e-6 * out.meshVolume) {
            continue;  // a sliver
        }
        try {
            out.hulls.push_back(convexHull(part.points, def.maxVertices));
        } catch (const InputError&) {
            continue;  // thinner than a shape may be
        }
        out.hullVolume += massProperties({&out.hulls.back(), 1}).mass / out.hulls.back().material.density;
    }
    if (out.hulls.empty()) {
        throw InputError("mesh", "no part of it is thick enough for a hull", "scale it up");
    }
    return out;
}

}  // namespace cairn
