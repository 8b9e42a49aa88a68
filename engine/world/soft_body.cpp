#include "engine/model/describe.hpp"
#include "engine/world/deformable_parts.hpp"

#include <map>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace cairn::deformables {
namespace {

using Vec4d = Eigen::Vector4d;
using Mat4d = Eigen::Matrix4d;

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

// Cells within a surface's box.
struct Grid {
    Vec3d origin;
    Vec3d step;  // m, of a cell
    std::array<int, 3> cells;

    Vec3d place(const Vec3d& at) const { return origin + at.cwiseProduct(step); }
};

// `depth` below the surface's box on all sides.
Grid gridIn(const TriangleMesh& surface, double cell, double depth) {
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
    Grid grid;
    grid.origin = low + Vec3d::Constant(depth);
    for (int k = 0; k < 3; ++k) {
        const double count = std::max(1.0, std::round(room(k) / cell));
        if (count > 1000) {
            throw InputError("soft.cell", text(cell), "more than 1000 cells along a side: give a larger one");
        }
        grid.cells[static_cast<std::size_t>(k)] = static_cast<int>(count);
        grid.step(k) = room(k) / count;
    }
    return grid;
}

// Cells whose middle is inside, five tetrahedra each, in two mirrored ways by turns so that they fit. cellsAround: of
// each vertex.
Tetrahedra tetrahedraInside(const TriangleMesh& surface, const Grid& grid, std::vector<int>& cellsAround) {
    Tetrahedra out;
    std::map<std::array<int, 3>, int> numbers;
    const auto vertex = [&](const std::array<int, 3>& key) {
        const auto [found, fresh] = numbers.try_emplace(key, static_cast<int>(out.vertices.size()));
        if (fresh) {
            out.vertices.push_back(grid.place(Vec3d(key[0], key[1], key[2])));
            cellsAround.push_back(0);
        }
        return found->second;
    };
    // Corners by bits x, y, z of the number; the tetrahedra of an even cell, mirrored in x for an odd one.
    constexpr std::array<std::array<int, 4>, 5> split = {
        {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 3, 0, 6}, {4, 5, 6, 0}, {7, 6, 5, 3}}};
    for (int i = 0; i < grid.cells[0]; ++i) {
        for (int j = 0; j < grid.cells[1]; ++j) {
            for (int k = 0; k < grid.cells[2]; ++k) {
                if (windingNumber(surface, grid.place(Vec3d(i + 0.5, j + 0.5, k + 0.5))) < 0.5) {
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
    return out;
}

// Draws what lies at the rim to `depth` below the surface, but no further than keeps neighbours apart.
void drawToSurface(const TriangleMesh& surface, double depth, const Vec3d& step, const std::vector<int>& cellsAround,
                   Tetrahedra& body) {
    const double furthest = 0.7 * step.minCoeff();
    for (std::size_t i = 0; i < body.vertices.size(); ++i) {
        if (cellsAround[i] == 8) {
            continue;
        }
        Vec3d& x = body.vertices[i];
        const Vec3d onSurface = closestOnMesh(surface, x);
        const bool inside = windingNumber(surface, x) > 0.5;
        const Vec3d inward = inside ? Vec3d(x - onSurface) : Vec3d(onSurface - x);
        const double distance = inward.norm();
        if (distance > 1e-9 * step.minCoeff()) {
            const Vec3d move = onSurface + inward * (depth / distance) - x;
            x += move * std::min(1.0, furthest / std::max(move.norm(), furthest));
        }
    }
}

// Without the cells of less volume, and without the vertices that only they have.
Tetrahedra withVolume(Tetrahedra out, double minVolume) {
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

// The inside of `surface`, at `depth` below it.
Tetrahedra fill(const TriangleMesh& surface, double cell, double depth) {
    const Grid grid = gridIn(surface, cell, depth);
    std::vector<int> cellsAround;
    Tetrahedra body = tetrahedraInside(surface, grid, cellsAround);
    drawToSurface(surface, depth, grid.step, cellsAround, body);
    // What the rim has pressed flat holds no volume.
    return withVolume(std::move(body), 0.05 * grid.step.prod() / 6);
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

// m3. Throws InputError for a surface that is open, or turned inside out.
double volumeInside(const TriangleMesh& surface) {
    double inside = 0;
    std::map<std::pair<int, int>, int> open;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        inside += corner(surface, t, 0).dot(corner(surface, t, 1).cross(corner(surface, t, 2))) / 6;
        for (std::size_t k = 0; k < 3; ++k) {
            const int a = surface.triangles[t][k];
            const int b = surface.triangles[t][(k + 1) % 3];
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
    return inside;
}

}  // namespace

Parts partsOf(const SoftBodyDef& def) {
    check(def, "soft");
    requireMesh("soft.surface", def.surface);
    const double inside = volumeInside(def.surface);
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

}  // namespace cairn::deformables
