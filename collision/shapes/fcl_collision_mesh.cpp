#include "base/base.hpp"
#include "collision/shapes/box_walk.hpp"
#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/fcl_layout.hpp"

#include <fcl/geometry/bvh/BVH_model.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

namespace cairn {

namespace {

// Vertices closer than this, and triangles lower than this, relative to the mesh's size, are one point or no triangle.
constexpr double weldTolerance = 1e-9;

void checkMesh(const TriangleMesh& mesh) {
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!mesh.vertices[i].allFinite()) {
            throw InputError("mesh.vertices[" + std::to_string(i) + "]", "not finite", "give finite lengths in m");
        }
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (int index : mesh.triangles[t]) {
            if (index < 0 || static_cast<std::size_t>(index) >= mesh.vertices.size()) {
                throw InputError("mesh.triangles[" + std::to_string(t) + "]", "index " + std::to_string(index),
                                 "there are " + std::to_string(mesh.vertices.size()) + " vertices, counted from 0");
            }
        }
    }
}

double sizeOf(const std::vector<Vec3d>& points) {
    if (points.empty()) {
        return 0;
    }
    Vec3d low = points.front();
    Vec3d high = points.front();
    for (const Vec3d& point : points) {
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
    }
    return (high - low).norm();
}

// For each vertex the first one (along a fixed direction) that is at the same place. The direction is along no likely
// plane of a model, so that few vertices share a place on it.
std::vector<int> weld(const std::vector<Vec3d>& vertices, double tolerance) {
    const Vec3d direction = Vec3d(1, std::numbers::sqrt2, std::numbers::sqrt3) / std::sqrt(6.0);
    std::vector<std::pair<double, int>> order;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        order.emplace_back(direction.dot(vertices[i]), static_cast<int>(i));
    }
    std::sort(order.begin(), order.end());
    std::vector<int> welded(vertices.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const Vec3d& here = vertices[static_cast<std::size_t>(order[i].second)];
        int same = order[i].second;
        for (std::size_t j = i; j-- > 0 && order[i].first - order[j].first <= tolerance;) {
            const auto other = static_cast<std::size_t>(order[j].second);
            if ((vertices[other] - here).norm() <= tolerance) {
                same = welded[other];
                break;
            }
        }
        welded[static_cast<std::size_t>(order[i].second)] = same;
    }
    return welded;
}

const Vec3d& cornerOf(const TriangleMesh& mesh, std::size_t triangle, std::size_t k) {
    return mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][k % 3])];
}

// The triangles with area, their vertices, their normals, and their numbers among those given.
TriangleMesh withArea(const TriangleMesh& given, double tolerance, std::vector<Vec3d>& normals,
                      std::vector<int>& numbers) {
    TriangleMesh kept;
    std::vector<int> renumbered(given.vertices.size(), -1);
    for (std::size_t t = 0; t < given.triangles.size(); ++t) {
        const auto at = [&](std::size_t k) -> const Vec3d& { return cornerOf(given, t, k); };
        const double longest = std::max({(at(1) - at(0)).norm(), (at(2) - at(1)).norm(), (at(0) - at(2)).norm()});
        const Vec3d cross = (at(1) - at(0)).cross(at(2) - at(0));
        if (cross.norm() <= tolerance * longest) {
            continue;
        }
        normals.push_back(cross.normalized());
        numbers.push_back(static_cast<int>(t));
        std::array<int, 3> triangle{};
        for (std::size_t k = 0; k < 3; ++k) {
            int& index = renumbered[static_cast<std::size_t>(given.triangles[t][k])];
            if (index < 0) {
                index = static_cast<int>(kept.vertices.size());
                kept.vertices.push_back(at(k));
            }
            triangle[k] = index;
        }
        kept.triangles.push_back(triangle);
    }
    if (kept.triangles.empty()) {
        throw InputError("mesh.triangles", std::to_string(given.triangles.size()) + ", none with area",
                         "give at least one triangle with area");
    }
    return kept;
}

// The side from vertex k to k + 1 of a triangle.
struct Side {
    int low, high;  // welded vertices
    int triangle;
    int k;
    bool rising;  // runs from low to high

    std::array<int, 2> edge() const { return {low, high}; }
};

// Those of one edge lie beside each other.
std::vector<Side> sidesByEdge(const TriangleMesh& mesh, const std::vector<int>& welded) {
    std::vector<Side> sides;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const int from = welded[static_cast<std::size_t>(mesh.triangles[t][k])];
            const int to = welded[static_cast<std::size_t>(mesh.triangles[t][(k + 1) % 3])];
            sides.push_back(
                {std::min(from, to), std::max(from, to), static_cast<int>(t), static_cast<int>(k), from < to});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.low, a.high, a.triangle, a.k) < std::tie(b.low, b.high, b.triangle, b.k);
    });
    return sides;
}

// Bit 3 + k: an active edge, of any triangle, ends at corner k.
void addSharpCorners(const TriangleMesh& mesh, const std::vector<int>& welded, std::vector<std::uint8_t>& activeEdges) {
    std::vector<bool> isSharp(mesh.vertices.size(), false);  // by welded vertex
    const auto weldedAt = [&](std::size_t t, std::size_t k) {
        return static_cast<std::size_t>(welded[static_cast<std::size_t>(mesh.triangles[t][k % 3])]);
    };
    for (std::size_t t = 0; t < activeEdges.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            if ((activeEdges[t] >> k & 1u) != 0) {
                isSharp[weldedAt(t, k)] = true;
                isSharp[weldedAt(t, k + 1)] = true;
            }
        }
    }
    for (std::size_t t = 0; t < activeEdges.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            activeEdges[t] |= static_cast<std::uint8_t>(isSharp[weldedAt(t, k)] ? 8u << k : 0u);
        }
    }
}

void build(fcl::BVHModel<fcl::AABB<double>>& model, const TriangleMesh& mesh) {
    std::vector<fcl::Triangle> indices;
    for (const std::array<int, 3>& t : mesh.triangles) {
        indices.emplace_back(static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]),
                             static_cast<std::size_t>(t[2]));
    }
    const bool built =
        model.beginModel(static_cast<int>(indices.size()), static_cast<int>(mesh.vertices.size())) == fcl::BVH_OK &&
        model.addSubModel(mesh.vertices, indices) == fcl::BVH_OK && model.endModel() == fcl::BVH_OK;
    CAIRN_CHECK(built, "the triangle tree could not be built");
}

}  // namespace

struct CollisionMesh::Tree {
    fcl::BVHModel<fcl::AABB<double>> model;
};

CollisionMesh::CollisionMesh(const TriangleMesh& given) : tree_(std::make_unique<Tree>()) {
    checkMesh(given);
    const double tolerance = weldTolerance * sizeOf(given.vertices);
    triangles_ = withArea(given, tolerance, normals_, given_);
    if (given_.size() == given.triangles.size()) {
        given_ = {};
    }
    bounds_ = {triangles_.vertices.front(), triangles_.vertices.front()};
    for (const Vec3d& vertex : triangles_.vertices) {
        bounds_ = {bounds_.min.cwiseMin(vertex), bounds_.max.cwiseMax(vertex)};
    }
    const std::vector<int> welded = weld(triangles_.vertices, tolerance);
    const std::vector<Side> sides = sidesByEdge(triangles_, welded);
    const auto corner = [&](const Side& side, std::size_t further) -> const Vec3d& {
        return cornerOf(triangles_, static_cast<std::size_t>(side.triangle),
                        static_cast<std::size_t>(side.k) + further);
    };
    activeEdges_.assign(triangles_.triangles.size(), 7);
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i + 1;
        while (end < sides.size() && sides[end].edge() == sides[i].edge()) {
            ++end;
        }
        // A border, an edge of more than two triangles, or of two turned against each other stays active.
        const bool isShared = end - i == 2 && sides[i].rising != sides[i + 1].rising;
        isClosed_ = isClosed_ && isShared;
        if (isShared) {
            const Side& a = sides[i];
            const Side& b = sides[i + 1];
            const Vec3d& onEdge = corner(a, 0);
            const Vec3d& opposite = corner(b, 2);
            const bool concave = normal(a.triangle).dot(opposite - onEdge) > tolerance;
            if (concave || normal(a.triangle).dot(normal(b.triangle)) > cosFlat) {
                for (const Side& side : {a, b}) {
                    activeEdges_[static_cast<std::size_t>(side.triangle)] &=
                        static_cast<std::uint8_t>(~(1u << static_cast<unsigned>(side.k)));
                }
            }
        }
        i = end;
    }
    addSharpCorners(triangles_, welded, activeEdges_);
    build(tree_->model, triangles_);
}

CollisionMesh::~CollisionMesh() = default;

bool CollisionMesh::edgeIsActive(int triangle, int k) const {
    return (activeEdges_[static_cast<std::size_t>(triangle)] >> static_cast<unsigned>(k)) & 1u;
}

namespace {

// The walk over FCL's nodes by their index.
template <class Model, class Measure, class Visit>
void walk(const Model& model, double limit, Measure measure, Visit visit) {
    walkNearest(
        0, limit,
        [&](int node, double within) {
            const auto& bv = model.getBV(node).bv;
            return measure(bv.min_, bv.max_, within);
        },
        [&](int node) { return model.getBV(node).isLeaf(); },
        [&](int node, int side) { return side == 0 ? model.getBV(node).leftChild() : model.getBV(node).rightChild(); },
        [&](int node, double within) { return visit(model.getBV(node).primitiveId(), within); });
}

}  // namespace

void CollisionMesh::castBox(const Vec3d& origin, const Vec3d& motion, const Vec3d& halfExtents, const Vec3d& scale,
                            double limit, FunctionRef<double(int, double)> visit) const {
    const MovingBox moving(origin, motion, halfExtents);
    walk(
        tree_->model, limit,
        [&](const Vec3d& low, const Vec3d& high, double within) {
            return moving.entry(low.cwiseProduct(scale), high.cwiseProduct(scale), within);
        },
        visit);
}

void CollisionMesh::near(const Aabb& box, const Vec3d& scale, double limit,
                         FunctionRef<double(int, double)> visit) const {
    walk(
        tree_->model, limit,
        [&](const Vec3d& low, const Vec3d& high, double) {
            return boxDistance(box, low.cwiseProduct(scale), high.cwiseProduct(scale));
        },
        visit);
}

std::size_t CollisionMesh::memory() const {
    const auto& model = tree_->model;
    // FCL counts its nodes and its own copies of vertices and triangles by their pointers only.
    const auto tree = static_cast<std::size_t>(model.getNumBVs()) * sizeof(model.getBV(0)) +
                      static_cast<std::size_t>(model.num_vertices) * sizeof(Vec3d) +
                      static_cast<std::size_t>(model.num_tris) * (sizeof(fcl::Triangle) + sizeof(unsigned));
    return sizeof(*this) + triangles_.vertices.capacity() * sizeof(Vec3d) +
           triangles_.triangles.capacity() * sizeof(std::array<int, 3>) + normals_.capacity() * sizeof(Vec3d) +
           activeEdges_.capacity() + tree;
}

void CollisionMesh::find(const Aabb& region, std::vector<int>& out) const {
    const fcl::AABB<double> box(region.min, region.max);
    const auto first = static_cast<std::ptrdiff_t>(out.size());
    // FCL's own queries copy the model; walking its nodes costs about 0.5 us and no allocation once the stack is warm.
    thread_local std::vector<int> open;
    open.assign(1, 0);
    while (!open.empty()) {
        const fcl::BVNode<fcl::AABB<double>>& node = tree_->model.getBV(open.back());
        open.pop_back();
        if (!node.bv.overlap(box)) {
            continue;
        }
        if (node.isLeaf()) {
            out.push_back(node.primitiveId());
        } else {
            open.push_back(node.rightChild());
            open.push_back(node.leftChild());
        }
    }
    std::sort(out.begin() + first, out.end());
}

}  // namespace cairn
