#include "engine/model/describe.hpp"
#include "engine/world/deformable_parts.hpp"

#include <map>

namespace cairn {

namespace deformables {
namespace {

Vec3d areaVector(const TriangleMesh& mesh, std::size_t t) {
    return 0.5 * (corner(mesh, t, 1) - corner(mesh, t, 0)).cross(corner(mesh, t, 2) - corner(mesh, t, 0));
}

// An edge of a sheet, seen along its first triangle's sense.
struct SheetEdge {
    int a, b;
    int across[2] = {-1, -1};  // the corners across it
    double area = 0;           // m2, of its triangles
};

std::map<std::pair<int, int>, SheetEdge> sheetEdges(const TriangleMesh& mesh) {
    std::map<std::pair<int, int>, SheetEdge> edges;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double area = areaVector(mesh, t).norm();
        for (std::size_t k = 0; k < 3; ++k) {
            const int a = mesh.triangles[t][k];
            const int b = mesh.triangles[t][(k + 1) % 3];
            SheetEdge& edge = edges.try_emplace({std::min(a, b), std::max(a, b)}, SheetEdge{a, b}).first->second;
            if (edge.across[1] >= 0) {
                throw InputError(
                    "cloth.mesh",
                    "three triangles at the edge of vertices " + std::to_string(a) + " and " + std::to_string(b),
                    "give a sheet: at most two triangles an edge");
            }
            edge.across[edge.across[0] < 0 ? 0 : 1] = mesh.triangles[t][(k + 2) % 3];
            edge.area += area;
        }
    }
    return edges;
}

}  // namespace

Parts partsOf(const ClothDef& def) {
    check(def, "cloth");
    requireMesh("cloth.mesh", def.mesh);
    const TriangleMesh& mesh = def.mesh;
    std::vector<double> area(mesh.vertices.size(), 0);
    double total = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double one = areaVector(mesh, t).norm();
        if (!(one > 0)) {
            throw InputError("cloth.mesh", "triangle " + std::to_string(t) + " without area", "leave it out");
        }
        total += one;
        for (const int v : mesh.triangles[t]) {
            area[static_cast<std::size_t>(v)] += one / 3;
        }
    }
    Parts parts;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!(area[i] > 0)) {
            throw InputError("cloth.mesh", "vertex " + std::to_string(i) + " without a triangle", "leave it out");
        }
        parts.particles.push_back(particle(def, static_cast<int>(i), mesh.vertices[i], def.mass * area[i] / total));
        parts.skin.vertices.push_back({{static_cast<int>(i), 1}});
    }
    parts.skin.triangles = mesh.triangles;
    parts.skin.thickness = 2 * def.radius;
    const auto edges = sheetEdges(mesh);
    for (const auto& entry : edges) {
        const SheetEdge& e = entry.second;
        const Vec3d& a = mesh.vertices[static_cast<std::size_t>(e.a)];
        const Vec3d& b = mesh.vertices[static_cast<std::size_t>(e.b)];
        // Van Gelder 1998: springs that stretch as the sheet does.
        const double stiffness = def.stretchStiffness * e.area / (b - a).squaredNorm();
        parts.joints.push_back(edge(e.a, e.b, a, b, spring(stiffness, def.damping)));
    }
    if (def.bendStiffness > 0) {
        for (const auto& entry : edges) {
            const SheetEdge& e = entry.second;
            if (e.across[1] < 0) {
                continue;
            }
            // Right for a sheet rolled along the legs of a right-angled grid or in any direction of equilateral
            // triangles; along the diagonals of a grid up to three times too stiff.
            const double length =
                (mesh.vertices[static_cast<std::size_t>(e.b)] - mesh.vertices[static_cast<std::size_t>(e.a)])
                    .squaredNorm();
            parts.joints.push_back(BendDef{.a = at(e.a),
                                           .b = at(e.b),
                                           .c = at(e.across[0]),
                                           .d = at(e.across[1]),
                                           .softness = spring(def.bendStiffness * length / e.area, def.damping)});
        }
    }
    return parts;
}

}  // namespace deformables

TriangleMesh clothGrid(const Vec3d& corner, const Vec3d& u, const Vec3d& v, int cellsU, int cellsV) {
    if (cellsU < 1 || cellsV < 1) {
        throw InputError("clothGrid.cells", std::to_string(cellsU) + " x " + std::to_string(cellsV),
                         "give at least one a side");
    }
    if (!corner.allFinite() || !(u.cross(v).norm() > 1e-9 * u.norm() * v.norm())) {
        throw InputError("clothGrid.u", "in one line with v, or not finite", "give two sides that span an area");
    }
    TriangleMesh mesh;
    for (int j = 0; j <= cellsV; ++j) {
        for (int i = 0; i <= cellsU; ++i) {
            mesh.vertices.push_back(corner + u * (static_cast<double>(i) / cellsU) +
                                    v * (static_cast<double>(j) / cellsV));
        }
    }
    const auto number = [&](int i, int j) { return j * (cellsU + 1) + i; };
    for (int j = 0; j < cellsV; ++j) {
        for (int i = 0; i < cellsU; ++i) {
            const int a = number(i, j);
            const int b = number(i + 1, j);
            const int c = number(i + 1, j + 1);
            const int d = number(i, j + 1);
            if ((i + j) % 2 == 0) {
                mesh.triangles.push_back({a, b, c});
                mesh.triangles.push_back({a, c, d});
            } else {
                mesh.triangles.push_back({a, b, d});
                mesh.triangles.push_back({b, c, d});
            }
        }
    }
    return mesh;
}

}  // namespace cairn
