#include <cairn/shapes.hpp>

#include "base/base.hpp"
#include "collision/shapes/hull.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <set>

namespace cairn {

namespace {

// How far a vertex may lie off a face's plane, or beyond it, relative to the hull's size.
constexpr double planeTolerance = 1e-6;
constexpr std::size_t scanLimit = 64;  // vertices

using Loop = std::vector<int>;
using DirectedEdges = std::map<std::array<int, 2>, int>;  // (from, to) -> face

const Vec3d& at(const std::vector<Vec3d>& points, int i) {
    return points[static_cast<std::size_t>(i)];
}

int next(const Loop& loop, std::size_t i) {
    return loop[i + 1 < loop.size() ? i + 1 : 0];
}

std::string edgeText(int from, int to) {
    return std::to_string(from) + "-" + std::to_string(to);
}

std::string faceField(std::size_t face) {
    return "hull.faces[" + std::to_string(face) + "]";
}

void checkIndices(const std::vector<Vec3d>& vertices, const std::vector<Loop>& faces) {
    if (vertices.size() < 4) {
        throw InputError("hull.vertices", std::to_string(vertices.size()) + " points", "give at least 4");
    }
    if (faces.size() < 4) {
        throw InputError("hull.faces", std::to_string(faces.size()) + " faces", "give at least 4");
    }
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (!vertices[i].allFinite()) {
            throw InputError("hull.vertices[" + std::to_string(i) + "]", "not finite", "give finite lengths in m");
        }
    }
    std::vector<bool> used(vertices.size(), false);
    for (std::size_t f = 0; f < faces.size(); ++f) {
        if (faces[f].size() < 3) {
            throw InputError(faceField(f), std::to_string(faces[f].size()) + " vertices", "give at least 3");
        }
        for (int index : faces[f]) {
            if (index < 0 || static_cast<std::size_t>(index) >= vertices.size()) {
                throw InputError(faceField(f), "index " + std::to_string(index),
                                 "give an index from 0 to " + std::to_string(vertices.size() - 1));
            }
            used[static_cast<std::size_t>(index)] = true;
        }
        if (std::set<int>(faces[f].begin(), faces[f].end()).size() != faces[f].size()) {
            throw InputError(faceField(f), "a vertex twice", "name each vertex of a face once");
        }
    }
    const auto unused = std::find(used.begin(), used.end(), false);
    if (unused != used.end()) {
        throw InputError("hull.vertices[" + std::to_string(unused - used.begin()) + "]", "on no face",
                         "leave it out, or make the faces with assets::convexHull");
    }
}

DirectedEdges directedEdges(const std::vector<Loop>& faces) {
    DirectedEdges edges;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        for (std::size_t i = 0; i < faces[f].size(); ++i) {
            const std::array<int, 2> edge{faces[f][i], next(faces[f], i)};
            if (!edges.emplace(edge, static_cast<int>(f)).second) {
                throw InputError(faceField(f), "edge " + edgeText(edge[0], edge[1]) + " as in another face",
                                 "wind all faces counter-clockwise seen from outside, each edge in two faces");
            }
        }
    }
    for (const auto& [edge, face] : edges) {
        if (!edges.contains({edge[1], edge[0]})) {
            throw InputError(faceField(static_cast<std::size_t>(face)),
                             "edge " + edgeText(edge[0], edge[1]) + " has one side",
                             "close the surface, each edge in two faces of opposite winding");
        }
    }
    return edges;
}

Hull::Face plane(const std::vector<Vec3d>& vertices, Loop loop) {
    Hull::Face face;
    const Vec3d origin = at(vertices, loop.front());  // near the face, so that far ones keep their digits
    Vec3d normal = Vec3d::Zero();
    for (std::size_t i = 0; i < loop.size(); ++i) {
        normal += (at(vertices, loop[i]) - origin).cross(at(vertices, next(loop, i)) - origin);
    }
    face.normal = normal.normalized();
    for (int index : loop) {
        face.offset += face.normal.dot(at(vertices, index)) / static_cast<double>(loop.size());
    }
    face.vertices = std::move(loop);
    return face;
}

double worstOffPlane(const std::vector<Vec3d>& vertices, const Hull::Face& face, const Loop& loop) {
    double worst = 0;
    for (int index : loop) {
        worst = std::max(worst, std::abs(face.normal.dot(at(vertices, index)) - face.offset));
    }
    return worst;
}

// Which faces lie in one plane with a first one and reach it through others that do: group of each face.
std::vector<int> coplanarGroups(const std::vector<Vec3d>& vertices, const std::vector<Hull::Face>& faces,
                                const DirectedEdges& edges, double tolerance) {
    std::vector<int> group(faces.size(), -1);
    int groups = 0;
    for (std::size_t seed = 0; seed < faces.size(); ++seed) {
        if (group[seed] >= 0) {
            continue;
        }
        group[seed] = groups;
        std::vector<std::size_t> open{seed};
        while (!open.empty()) {
            const Loop& loop = faces[open.back()].vertices;
            open.pop_back();
            for (std::size_t i = 0; i < loop.size(); ++i) {
                const auto other = static_cast<std::size_t>(edges.at({next(loop, i), loop[i]}));
                if (group[other] < 0 && faces[other].normal.dot(faces[seed].normal) > 0 &&
                    worstOffPlane(vertices, faces[seed], faces[other].vertices) <= tolerance) {
                    group[other] = groups;
                    open.push_back(other);
                }
            }
        }
        ++groups;
    }
    return group;
}

// The outlines of the groups: edges whose other side is in another group, chained.
std::vector<Loop> outlines(const DirectedEdges& edges, const std::vector<int>& group) {
    std::vector<std::map<int, int>> follow(static_cast<std::size_t>(*std::max_element(group.begin(), group.end())) + 1);
    for (const auto& [edge, face] : edges) {
        const int here = group[static_cast<std::size_t>(face)];
        if (group[static_cast<std::size_t>(edges.at({edge[1], edge[0]}))] != here) {
            follow[static_cast<std::size_t>(here)].emplace(edge[0], edge[1]);
        }
    }
    std::vector<Loop> loops;
    for (std::size_t g = 0; g < follow.size(); ++g) {
        Loop loop;
        if (!follow[g].empty()) {
            const int first = follow[g].begin()->first;
            int vertex = first;
            do {
                loop.push_back(vertex);
                const auto step = follow[g].find(vertex);
                vertex = step == follow[g].end() ? first : step->second;
            } while (vertex != first && loop.size() <= follow[g].size());
        }
        if (loop.size() < 3 || loop.size() != follow[g].size()) {
            const auto face = std::find(group.begin(), group.end(), static_cast<int>(g)) - group.begin();
            throw InputError(faceField(static_cast<std::size_t>(face)), "its coplanar neighbours enclose others",
                             "make the faces with assets::convexHull");
        }
        loops.push_back(std::move(loop));
    }
    return loops;
}

// Renumbers the vertices so that only those where three faces or more meet are left.
void dropFlatVertices(std::vector<Vec3d>& vertices, std::vector<Loop>& loops) {
    std::vector<int> meeting(vertices.size(), 0);
    for (const Loop& loop : loops) {
        for (int index : loop) {
            ++meeting[static_cast<std::size_t>(index)];
        }
    }
    std::vector<int> renumbered(vertices.size(), -1);
    std::vector<Vec3d> kept;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (meeting[i] >= 3) {
            renumbered[i] = static_cast<int>(kept.size());
            kept.push_back(vertices[i]);
        }
    }
    for (Loop& loop : loops) {
        Loop corners;
        for (int index : loop) {
            if (renumbered[static_cast<std::size_t>(index)] >= 0) {
                corners.push_back(renumbered[static_cast<std::size_t>(index)]);
            }
        }
        loop = std::move(corners);
    }
    vertices = std::move(kept);
}

// Of the tolerance of planes, a hull from face to farthest vertex.
constexpr double thinnest = 10;

void checkConvex(const std::vector<Vec3d>& vertices, const std::vector<Hull::Face>& faces, double tolerance) {
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const Hull::Face& face = faces[f];
        double depth = 0;
        for (std::size_t v = 0; v < vertices.size(); ++v) {
            const double beyond = face.normal.dot(vertices[v]) - face.offset;
            if (beyond > tolerance) {
                throw InputError(faceField(f), "vertex " + std::to_string(v) + " lies outside its plane",
                                 "give a convex solid, or make the faces with assets::convexHull");
            }
            depth = std::max(depth, -beyond);
        }
        // Thinner than that for its length, it has faces that none can tell from their neighbours.
        const double least = std::max(minShapeSize(), thinnest * tolerance);
        if (!(depth >= least)) {
            throw InputError("hull.vertices", "flat (" + std::to_string(depth) + " m thick)",
                             "give a solid at least " + std::to_string(least) + " m thick");
        }
    }
}

// Faces merged from coplanar ones could still be L-shaped where the surface doubles back on itself.
void checkLoopConvex(const std::vector<Vec3d>& vertices, const Hull::Face& face, double tolerance) {
    for (std::size_t i = 0; i < face.vertices.size(); ++i) {
        const Vec3d& from = at(vertices, face.vertices[i]);
        const Vec3d side = face.normal.cross(at(vertices, next(face.vertices, i)) - from).normalized();
        for (int index : face.vertices) {
            if (side.dot(at(vertices, index) - from) < -tolerance) {
                throw InputError("hull.faces", "a face that is not convex",
                                 "give a convex solid, or make the faces with assets::convexHull");
            }
        }
    }
}

}  // namespace

Hull makeHull(std::vector<Vec3d> vertices, std::vector<std::vector<int>> loops) {
    checkIndices(vertices, loops);
    Vec3d low = vertices.front();
    Vec3d high = vertices.front();
    for (const Vec3d& vertex : vertices) {
        low = low.cwiseMin(vertex);
        high = high.cwiseMax(vertex);
    }
    const double tolerance = planeTolerance * (high - low).norm();
    const DirectedEdges given = directedEdges(loops);

    std::vector<Hull::Face> faces;
    double volume = 0;
    const Vec3d middle = 0.5 * (low + high);
    for (std::size_t f = 0; f < loops.size(); ++f) {
        faces.push_back(plane(vertices, loops[f]));
        if (faces.back().normal.squaredNorm() < 0.5) {
            throw InputError(faceField(f), "no area", "leave out faces of no area and weld their vertices");
        }
        if (worstOffPlane(vertices, faces.back(), loops[f]) > tolerance) {
            throw InputError(faceField(f), "not planar", "cut it into triangles");
        }
        for (std::size_t i = 2; i < loops[f].size(); ++i) {
            const Vec3d a = at(vertices, loops[f][0]) - middle;
            volume += a.dot((at(vertices, loops[f][i - 1]) - middle).cross(at(vertices, loops[f][i]) - middle)) / 6;
        }
    }
    if (volume < 0) {
        throw InputError("hull.faces", "turned inside out", "wind faces counter-clockwise seen from outside");
    }
    checkConvex(vertices, faces, tolerance);

    std::vector<Loop> merged = outlines(given, coplanarGroups(vertices, faces, given, tolerance));
    dropFlatVertices(vertices, merged);
    Hull hull;
    hull.vertices = std::move(vertices);
    for (Loop& loop : merged) {
        hull.faces.push_back(plane(hull.vertices, std::move(loop)));
        checkLoopConvex(hull.vertices, hull.faces.back(), 4 * tolerance);
    }
    hull.neighbours.resize(hull.vertices.size());
    for (const Hull::Face& face : hull.faces) {
        for (std::size_t i = 0; i < face.vertices.size(); ++i) {
            const int from = face.vertices[i];
            const int to = next(face.vertices, i);
            hull.neighbours[static_cast<std::size_t>(from)].push_back(to);
            if (from < to) {
                hull.edges.push_back({from, to});
            }
        }
    }
    std::sort(hull.edges.begin(), hull.edges.end());
    for (std::vector<int>& neighbours : hull.neighbours) {
        std::sort(neighbours.begin(), neighbours.end());
    }
    hull.low = hull.vertices.front();
    hull.high = hull.vertices.front();
    for (const Vec3d& vertex : hull.vertices) {
        hull.low = hull.low.cwiseMin(vertex);
        hull.high = hull.high.cwiseMax(vertex);
        hull.centre += vertex / static_cast<double>(hull.vertices.size());
        hull.vertexGroups.add(vertex);
    }
    for (const Hull::Face& face : hull.faces) {
        hull.normalGroups.add(face.normal);
    }
    return hull;
}

void depthsBehind(const Hull& hull, const Vec3d& point, std::vector<double>& out) {
    hull.normalGroups.dots(point, out);
    for (std::size_t i = 0; i < hull.faces.size(); ++i) {
        out[i] = hull.faces[i].offset - out[i];
    }
}

bool isScanned(const Hull& hull) {
    return hull.vertices.size() <= scanLimit;
}

int supportVertex(const Hull& hull, const Vec3d& direction, int start) {
    if (isScanned(hull)) {
        return hull.vertexGroups.farthest(direction);
    }
    int best = start;
    double largest = direction.dot(at(hull.vertices, best));
    for (int from = -1; from != best;) {
        from = best;
        for (int to : hull.neighbours[static_cast<std::size_t>(from)]) {
            const double along = direction.dot(at(hull.vertices, to));
            if (along > largest || (along == largest && to < best)) {
                largest = along;
                best = to;
            }
        }
    }
    return best;
}

int supportFace(const Hull& hull, const Vec3d& direction) {
    return hull.normalGroups.farthest(direction);
}

}  // namespace cairn
