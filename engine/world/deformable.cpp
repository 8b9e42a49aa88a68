#include <cairn/deformable.hpp>

#include "base/so3.hpp"
#include "engine/model/describe.hpp"

#include <map>
#include <numbers>
#include <set>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace cairn {
namespace {

using Vec4d = Eigen::Vector4d;
using Mat4d = Eigen::Matrix4d;

// Bodies and joints of a deformable; joints name particles by their place, generation 0.
struct Parts {
    std::vector<BodyDef> particles;
    std::vector<JointDef> joints;
    Skin skin;
};

std::string text(double value) {
    return std::to_string(value);
}

BodyId at(int particle) {
    return {static_cast<std::uint32_t>(particle), 0};
}

// A spring of `stiffness` (N/m or N m/rad) that relaxes in `time` (s).
Softness spring(double stiffness, double time) {
    if (stiffness == unlimited) {
        return {};
    }
    return {.compliance = 1 / stiffness, .damping = time * stiffness};
}

template <class Def>
BodyDef particle(const Def& def, int number, const Vec3d& position, double mass) {
    BodyDef body;
    body.name = def.name.empty() ? std::string() : def.name + " " + std::to_string(number);
    body.particle = true;
    body.shapes = {sphere(def.radius)};
    body.shapes[0].material.friction = def.friction;
    body.position = position;
    body.linearVelocity = def.velocity;
    body.mass = mass;
    body.linearDamping = def.airDamping;
    body.filter = def.filter;
    return body;
}

JointDef edge(int a, int b, const Vec3d& atA, const Vec3d& atB, const Softness& softness) {
    return DistanceDef{.a = at(a), .b = at(b), .anchorA = atA, .anchorB = atB, .softness = softness, .collide = true};
}

Parts partsOf(const RopeDef& def) {
    check(def, "rope");
    const double length = (def.to - def.from).norm();
    Parts parts;
    const double share = def.mass / def.segments;
    for (int i = 0; i <= def.segments; ++i) {
        const bool end = i == 0 || i == def.segments;
        const Vec3d x = def.from + (def.to - def.from) * (static_cast<double>(i) / def.segments);
        parts.particles.push_back(particle(def, i, x, end ? share / 2 : share));
        if (i > 0) {
            const double stiffness = def.stiffness / (length / def.segments);
            parts.joints.push_back(edge(i - 1, i, parts.particles[static_cast<std::size_t>(i - 1)].position, x,
                                        spring(stiffness, def.damping)));
        }
    }
    parts.skin.thickness = 2 * def.radius;
    return parts;
}

void requireMesh(const std::string& field, const TriangleMesh& mesh) {
    if (mesh.triangles.empty()) {
        throw InputError(field, "no triangles", "give a mesh with at least one triangle");
    }
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!mesh.vertices[i].allFinite()) {
            throw InputError(field + ".vertices", "vertex " + std::to_string(i) + ", a non-finite number",
                             "give finite numbers");
        }
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const int v : mesh.triangles[t]) {
            if (v < 0 || static_cast<std::size_t>(v) >= mesh.vertices.size()) {
                throw InputError(field + ".triangles",
                                 "triangle " + std::to_string(t) + " with vertex " + std::to_string(v),
                                 "give vertex numbers below " + std::to_string(mesh.vertices.size()));
            }
        }
    }
}

const Vec3d& corner(const TriangleMesh& mesh, std::size_t triangle, int k) {
    return mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][static_cast<std::size_t>(k % 3)])];
}

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

// The solid angle of the surface seen from x over 4 pi: 1 inside, 0 outside (van Oosterom and Strackee).
double windingNumber(const TriangleMesh& mesh, const Vec3d& x) {
    double sum = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3d a = corner(mesh, t, 0) - x;
        const Vec3d b = corner(mesh, t, 1) - x;
        const Vec3d c = corner(mesh, t, 2) - x;
        const double la = a.norm();
        const double lb = b.norm();
        const double lc = c.norm();
        sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (2 * std::numbers::pi);
}

Vec3d closestOnTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& x) {
    const Vec3d n = (b - a).cross(c - a);
    const Vec3d inPlane = x - n * (n.dot(x - a) / n.squaredNorm());
    const std::array<const Vec3d*, 4> loop = {&a, &b, &c, &a};
    bool inside = true;
    Vec3d best = a;
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d side = *loop[k + 1] - *loop[k];
        inside = inside && n.dot(side.cross(inPlane - *loop[k])) >= 0;
        const double share = std::clamp(side.dot(x - *loop[k]) / side.squaredNorm(), 0.0, 1.0);
        const Vec3d onSide = *loop[k] + share * side;
        if ((x - onSide).squaredNorm() < smallest) {
            smallest = (x - onSide).squaredNorm();
            best = onSide;
        }
    }
    return inside ? inPlane : best;
}

Vec3d closestOnMesh(const TriangleMesh& mesh, const Vec3d& x) {
    Vec3d best = mesh.vertices[0];
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3d p = closestOnTriangle(corner(mesh, t, 0), corner(mesh, t, 1), corner(mesh, t, 2), x);
        if ((x - p).squaredNorm() < smallest) {
            smallest = (x - p).squaredNorm();
            best = p;
        }
    }
    return best;
}

struct Tetrahedra {
    std::vector<Vec3d> vertices;
    std::vector<std::array<int, 4>> cells;  // positive volume
};

double volumeOf(const Tetrahedra& t, const std::array<int, 4>& cell) {
    const auto x = [&](std::size_t k) -> const Vec3d& { return t.vertices[static_cast<std::size_t>(cell[k])]; };
    return (x(1) - x(0)).dot((x(2) - x(0)).cross(x(3) - x(0))) / 6;
}

// The inside of `surface`, at `depth` below it: cells of a grid whose middle is inside, five tetrahedra each, in two
// mirrored ways by turns so that they fit; then what lies at the rim is drawn to the surface.
Tetrahedra fill(const TriangleMesh& surface, double cell, double depth) {
    Vec3d low = surface.vertices[static_cast<std::size_t>(surface.triangles[0][0])];
    Vec3d high = low;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        for (int k = 0; k < 3; ++k) {
            low = low.cwiseMin(corner(surface, t, k));
            high = high.cwiseMax(corner(surface, t, k));
        }
    }
    const Vec3d room = high - low - Vec3d::Constant(2 * depth);
    if (!(room.minCoeff() > 0)) {
        throw InputError(
            "soft.radius", text(depth),
            "its particles do not fit inside the surface: give less than " + text(0.5 * (high - low).minCoeff()));
    }
    std::array<int, 3> cells;
    Vec3d step;
    for (int k = 0; k < 3; ++k) {
        const double count = std::max(1.0, std::round(room(k) / cell));
        if (count > 1000) {
            throw InputError("soft.cell", text(cell), "more than 1000 cells along a side: give a larger one");
        }
        cells[static_cast<std::size_t>(k)] = static_cast<int>(count);
        step(k) = room(k) / count;
    }
    const auto place = [&](const Vec3d& grid) -> Vec3d {
        return low + Vec3d::Constant(depth) + grid.cwiseProduct(step);
    };
    Tetrahedra out;
    std::map<std::array<int, 3>, int> numbers;
    std::vector<int> cellsAround;
    const auto vertex = [&](const std::array<int, 3>& grid) {
        const auto [found, fresh] = numbers.try_emplace(grid, static_cast<int>(out.vertices.size()));
        if (fresh) {
            out.vertices.push_back(place(Vec3d(grid[0], grid[1], grid[2])));
            cellsAround.push_back(0);
        }
        return found->second;
    };
    // Corners by bits x, y, z of the number; the tetrahedra of an even cell, mirrored in x for an odd one.
    constexpr std::array<std::array<int, 4>, 5> split = {
        {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 3, 0, 6}, {4, 5, 6, 0}, {7, 6, 5, 3}}};
    for (int i = 0; i < cells[0]; ++i) {
        for (int j = 0; j < cells[1]; ++j) {
            for (int k = 0; k < cells[2]; ++k) {
                if (windingNumber(surface, place(Vec3d(i + 0.5, j + 0.5, k + 0.5))) < 0.5) {
                    continue;
                }
                std::array<int, 8> number;
                const int mirror = (i + j + k) % 2;
                for (int c = 0; c < 8; ++c) {
                    number[static_cast<std::size_t>(c)] =
                        vertex({i + ((c & 1) ^ mirror), j + (c >> 1 & 1), k + (c >> 2 & 1)});
                    ++cellsAround[static_cast<std::size_t>(number[static_cast<std::size_t>(c)])];
                }
                for (const std::array<int, 4>& tetrahedron : split) {
                    std::array<int, 4> cellOf;
                    for (std::size_t c = 0; c < 4; ++c) {
                        cellOf[c] = number[static_cast<std::size_t>(tetrahedron[c])];
                    }
                    if (volumeOf(out, cellOf) < 0) {
                        std::swap(cellOf[2], cellOf[3]);
                    }
                    out.cells.push_back(cellOf);
                }
            }
        }
    }
    // To the surface, but no further than keeps neighbours apart.
    const double furthest = 0.7 * step.minCoeff();
    for (std::size_t i = 0; i < out.vertices.size(); ++i) {
        if (cellsAround[i] == 8) {
            continue;
        }
        Vec3d& x = out.vertices[i];
        const Vec3d onSurface = closestOnMesh(surface, x);
        const bool inside = windingNumber(surface, x) > 0.5;
        const Vec3d inward = inside ? Vec3d(x - onSurface) : Vec3d(onSurface - x);
        const double distance = inward.norm();
        if (distance > 1e-9 * step.minCoeff()) {
            const Vec3d move = onSurface + inward * (depth / distance) - x;
            x += move * std::min(1.0, furthest / std::max(move.norm(), furthest));
        }
    }
    // What the rim has pressed flat holds no volume.
    const double minVolume = 0.05 * step.prod() / 6;
    std::erase_if(out.cells, [&](const std::array<int, 4>& c) { return volumeOf(out, c) < minVolume; });
    std::vector<int> renumbered(out.vertices.size(), -1);
    Tetrahedra kept;
    for (std::array<int, 4> c : out.cells) {
        for (int& v : c) {
            int& now = renumbered[static_cast<std::size_t>(v)];
            if (now < 0) {
                now = static_cast<int>(kept.vertices.size());
                kept.vertices.push_back(out.vertices[static_cast<std::size_t>(v)]);
            }
            v = now;
        }
        kept.cells.push_back(c);
    }
    return kept;
}

// The surface with its triangles cut in four until no edge is longer than `longest`, so that it can bend.
TriangleMesh refined(TriangleMesh mesh, double longest) {
    const auto tooLong = [&] {
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            for (int k = 0; k < 3; ++k) {
                if ((corner(mesh, t, k) - corner(mesh, t, k + 1)).norm() > longest) {
                    return true;
                }
            }
        }
        return false;
    };
    // Eight passes make 65,536 of one.
    for (int iteration = 0; iteration < 8 && mesh.triangles.size() < 8000 && tooLong(); ++iteration) {
        std::map<std::pair<int, int>, int> middles;
        const auto middle = [&](int a, int b) {
            const auto [found, fresh] =
                middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<int>(mesh.vertices.size()));
            if (fresh) {
                mesh.vertices.push_back(
                    0.5 * (mesh.vertices[static_cast<std::size_t>(a)] + mesh.vertices[static_cast<std::size_t>(b)]));
            }
            return found->second;
        };
        std::vector<std::array<int, 3>> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const int ab = middle(a, b);
            const int bc = middle(b, c);
            const int ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    return mesh;
}

// The surface's vertices as sums of the particles around them by moving least squares: it follows every affine motion
// exactly and is smooth between, whatever the tetrahedra. `spacing` (m): of the particles.
Skin skinOf(const TriangleMesh& surface, const std::vector<Vec3d>& particles, double spacing) {
    Skin skin;
    skin.triangles = surface.triangles;
    for (const Vec3d& x : surface.vertices) {
        std::vector<Skin::Weight> weights;
        // Wide enough for particles on all sides; from the second ring on they span space.
        for (double radius = 2.2 * spacing; weights.empty(); radius *= 1.5) {
            Mat4d moments = Mat4d::Zero();
            std::vector<std::pair<int, Vec4d>> near;
            for (std::size_t i = 0; i < particles.size(); ++i) {
                const Vec3d d = (particles[i] - x) / radius;
                const double share = 1 - d.squaredNorm();
                if (share > 0) {
                    const Vec4d basis(1, d.x(), d.y(), d.z());
                    moments += share * share * basis * basis.transpose();
                    near.emplace_back(static_cast<int>(i), share * share * basis);
                }
            }
            const Eigen::SelfAdjointEigenSolver<Mat4d> spread(moments);
            const bool spans = spread.eigenvalues()(0) > 1e-3 * spread.eigenvalues()(3);
            if (spans || near.size() == particles.size()) {
                // Particles in one plane cannot say what lies beside it: there the least solution stands in.
                const Vec4d atX = moments.completeOrthogonalDecomposition().solve(Vec4d(1, 0, 0, 0));
                for (const auto& [i, basis] : near) {
                    weights.push_back({i, basis.dot(atX)});
                }
            }
        }
        skin.vertices.push_back(std::move(weights));
    }
    return skin;
}

Parts partsOf(const SoftBodyDef& def) {
    check(def, "soft");
    requireMesh("soft.surface", def.surface);
    double inside = 0;
    std::map<std::pair<int, int>, int> open;
    for (std::size_t t = 0; t < def.surface.triangles.size(); ++t) {
        inside += corner(def.surface, t, 0).dot(corner(def.surface, t, 1).cross(corner(def.surface, t, 2))) / 6;
        for (std::size_t k = 0; k < 3; ++k) {
            const int a = def.surface.triangles[t][k];
            const int b = def.surface.triangles[t][(k + 1) % 3];
            open[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
        }
    }
    const auto hole = std::find_if(open.begin(), open.end(), [](const auto& e) { return e.second != 0; });
    if (hole != open.end()) {
        throw InputError("soft.surface",
                         "open, or of mixed sense, at the edge of vertices " + std::to_string(hole->first.first) +
                             " and " + std::to_string(hole->first.second),
                         "give a closed surface whose triangles share their vertices");
    }
    if (!(inside > 0)) {
        throw InputError("soft.surface", "volume " + text(inside),
                         "give triangles counter-clockwise seen from outside");
    }
    const Tetrahedra body = fill(def.surface, def.cell, def.radius);
    if (body.cells.empty()) {
        throw InputError("soft.cell", text(def.cell), "no cell fits inside the surface: give a smaller one");
    }
    Parts parts;
    std::vector<double> share(body.vertices.size(), 0);
    double filled = 0;
    std::map<std::pair<int, int>, double> edges;  // m3, of the tetrahedra about each
    for (const std::array<int, 4>& cell : body.cells) {
        const double volume = volumeOf(body, cell);
        filled += volume;
        for (std::size_t a = 0; a < 4; ++a) {
            share[static_cast<std::size_t>(cell[a])] += volume / 4;
            for (std::size_t b = 0; b < a; ++b) {
                edges[{std::min(cell[a], cell[b]), std::max(cell[a], cell[b])}] += volume;
            }
        }
    }
    const double mass = def.mass > 0 ? def.mass : def.density * inside;
    for (std::size_t i = 0; i < body.vertices.size(); ++i) {
        parts.particles.push_back(particle(def, static_cast<int>(i), body.vertices[i], mass * share[i] / filled));
    }
    for (const auto& [ends, volume] : edges) {
        const Vec3d& a = body.vertices[static_cast<std::size_t>(ends.first)];
        const Vec3d& b = body.vertices[static_cast<std::size_t>(ends.second)];
        // Van Gelder's rule in three dimensions.
        parts.joints.push_back(edge(ends.first, ends.second, a, b,
                                    spring(def.youngModulus * volume / (b - a).squaredNorm(), def.damping)));
    }
    if (def.bulkModulus > 0) {
        for (const std::array<int, 4>& cell : body.cells) {
            // VolumeDef's C is a length: a relative change e of the volume is C = (6 V)^(1/3) e.
            const double volume = volumeOf(body, cell);
            const double side = std::cbrt(6 * volume);
            parts.joints.push_back(
                VolumeDef{.a = at(cell[0]),
                          .b = at(cell[1]),
                          .c = at(cell[2]),
                          .d = at(cell[3]),
                          .softness = spring(def.bulkModulus * volume / (side * side), def.damping)});
        }
    }
    parts.skin = skinOf(refined(def.surface, 0.5 * def.cell), body.vertices, def.cell);
    return parts;
}

// The particles that an attachment holds.
std::vector<std::size_t> held(const Attachment& attachment, const std::vector<BodyDef>& particles) {
    std::vector<std::size_t> found;
    std::size_t nearest = 0;
    const auto distance = [&](std::size_t i) { return (particles[i].position - attachment.position).norm(); };
    for (std::size_t i = 0; i < particles.size(); ++i) {
        if (distance(i) < distance(nearest)) {
            nearest = i;
        }
        if (distance(i) <= attachment.radius) {
            found.push_back(i);
        }
    }
    if (attachment.radius == 0) {
        return {nearest};
    }
    if (found.empty()) {
        throw InputError("attachments.radius", text(attachment.radius),
                         "no particle is so near: the nearest is at " + text(distance(nearest)) + " m");
    }
    return found;
}

// The place of the vertices, weighted normals, and the edge loops of an open sheet make a closed shell.
TriangleMesh shell(const std::vector<Vec3d>& middle, const std::vector<std::array<int, 3>>& triangles,
                   double thickness) {
    TriangleMesh mesh;
    std::vector<Vec3d> normal(middle.size(), Vec3d::Zero());
    std::map<std::pair<int, int>, int> rim;
    for (const std::array<int, 3>& t : triangles) {
        const auto x = [&](std::size_t k) -> const Vec3d& { return middle[static_cast<std::size_t>(t[k])]; };
        const Vec3d n = (x(1) - x(0)).cross(x(2) - x(0));
        for (std::size_t k = 0; k < 3; ++k) {
            normal[static_cast<std::size_t>(t[k])] += n;
            const std::pair<int, int> back{t[(k + 1) % 3], t[k]};
            if (rim.erase(back) == 0) {
                rim[{t[k], t[(k + 1) % 3]}] = 1;
            }
        }
    }
    const int n = static_cast<int>(middle.size());
    for (const double side : {0.5, -0.5}) {
        for (std::size_t i = 0; i < middle.size(); ++i) {
            mesh.vertices.push_back(middle[i] + side * thickness * normal[i].stableNormalized());
        }
    }
    for (const auto& [a, b, c] : triangles) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({n + a, n + c, n + b});
    }
    for (const auto& [side, count] : rim) {
        const auto [a, b] = side;
        mesh.triangles.push_back({a, n + a, b});
        mesh.triangles.push_back({b, n + a, n + b});
    }
    return mesh;
}

// A tube about a line, with caps.
TriangleMesh tube(const std::vector<Vec3d>& line, double radius) {
    constexpr int around = 12;
    TriangleMesh mesh;
    const std::size_t n = line.size();
    Vec3d across = Vec3d::UnitX();
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3d along = (line[std::min(i + 1, n - 1)] - line[i > 0 ? i - 1 : 0]).stableNormalized();
        // Carried along without twist.
        across -= along * along.dot(across);
        if (!(across.norm() > 0.1)) {
            Vec3d other;
            completeBasis<double>(along.isZero() ? Vec3d(Vec3d::UnitY()) : along, across, other);
        }
        across.normalize();
        const Vec3d third = along.cross(across);
        for (int k = 0; k < around; ++k) {
            const double angle = 2 * std::numbers::pi * k / around;
            mesh.vertices.push_back(line[i] + radius * (std::cos(angle) * across + std::sin(angle) * third));
        }
    }
    const auto ring = [](std::size_t i, int k) { return static_cast<int>(i) * around + k % around; };
    for (std::size_t i = 0; i + 1 < n; ++i) {
        for (int k = 0; k < around; ++k) {
            mesh.triangles.push_back({ring(i, k), ring(i, k + 1), ring(i + 1, k)});
            mesh.triangles.push_back({ring(i + 1, k), ring(i, k + 1), ring(i + 1, k + 1)});
        }
    }
    for (int k = 1; k + 1 < around; ++k) {
        mesh.triangles.push_back({ring(0, 0), ring(0, k + 1), ring(0, k)});
        mesh.triangles.push_back({ring(n - 1, 0), ring(n - 1, k), ring(n - 1, k + 1)});
    }
    return mesh;
}

}  // namespace

template <class S>
Deformable addDeformable(World<S>& world, const DeformableDef& def) {
    Parts parts = std::visit([](const auto& d) { return partsOf(d); }, def);
    const std::vector<Attachment>& attachments =
        std::visit([](const auto& d) -> const std::vector<Attachment>& { return d.attachments; }, def);
    const auto [group, name] = std::visit([](const auto& d) { return std::pair(d.filter.group, d.name); }, def);
    if (group == 0) {
        int lowest = 0;
        for (const BodyId id : world.bodies()) {
            lowest = std::min(lowest, world.def(id).filter.group);
        }
        for (BodyDef& body : parts.particles) {
            body.filter.group = lowest - 1;
        }
    }
    Deformable added;
    try {
        for (const BodyDef& body : parts.particles) {
            added.particles.push_back(world.add(body));
        }
        for (JointDef& joint : parts.joints) {
            std::visit(
                [&](auto& j) {
                    const auto place = [&](BodyId& id) { id = added.particles[id.index]; };
                    place(j.a);
                    place(j.b);
                    if constexpr (requires { j.d; }) {
                        place(j.c);
                        place(j.d);
                    }
                },
                joint);
            added.joints.push_back(world.addJoint(joint));
        }
        for (const Attachment& attachment : attachments) {
            check(attachment, "attachments");
            for (const std::size_t i : held(attachment, parts.particles)) {
                added.attachments.push_back(world.add(
                    BallDef{.a = attachment.body, .b = added.particles[i], .anchor = parts.particles[i].position}));
            }
        }
    } catch (...) {
        for (const BodyId id : added.particles) {
            world.remove(id);
        }
        throw;
    }
    added.skin = std::move(parts.skin);
    return added;
}

template <class S>
TriangleMesh surfaceOf(const World<S>& world, const Deformable& deformable) {
    std::vector<Vec3d> at;
    for (const BodyId id : deformable.particles) {
        at.push_back(world.centre(id).template cast<double>());
    }
    const Skin& skin = deformable.skin;
    if (skin.triangles.empty()) {
        return tube(at, 0.5 * skin.thickness);
    }
    TriangleMesh mesh;
    for (const std::vector<Skin::Weight>& weights : skin.vertices) {
        Vec3d x = Vec3d::Zero();
        for (const Skin::Weight& w : weights) {
            x += w.weight * at[static_cast<std::size_t>(w.particle)];
        }
        mesh.vertices.push_back(x);
    }
    if (skin.thickness > 0) {
        return shell(mesh.vertices, skin.triangles, skin.thickness);
    }
    mesh.triangles = skin.triangles;
    return mesh;
}

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

template Deformable addDeformable(World<float>&, const DeformableDef&);
template Deformable addDeformable(World<double>&, const DeformableDef&);
template TriangleMesh surfaceOf(const World<float>&, const Deformable&);
template TriangleMesh surfaceOf(const World<double>&, const Deformable&);

}  // namespace cairn
