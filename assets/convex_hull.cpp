#include <cairn/assets/convex_hull.hpp>

#include "base/digits.hpp"
#include "collision/collision.hpp"

#include <libqhull_r/qhull_ra.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

namespace cairn {

namespace {

// Relative to the size of the point set. Below it points count as one, points as in one plane. Coordinates
// read from files are floats, good to 6e-8.
constexpr double closeness = 1e-7;

struct Polyhedron {
    std::vector<Vec3d> vertices;
    std::vector<std::vector<int>> faces;
};

// A qhull run: what C allocates is given back however it ends.
class Qhull {
public:
    Qhull() {
        messages_ = open_memstream(&text_, &length_);
        if (messages_ == nullptr) {
            throw std::bad_alloc();
        }
        qh_zero(&qh_, messages_);
    }
    ~Qhull() {
        qh_freeqhull(&qh_, !qh_ALL);
        int kept = 0;
        int total = 0;
        qh_memfreeshort(&qh_, &kept, &total);
        std::fclose(messages_);
        std::free(text_);
    }
    Qhull(const Qhull&) = delete;
    Qhull& operator=(const Qhull&) = delete;

    bool run(std::vector<Vec3d>& points, std::string command) {
        return qh_new_qhull(&qh_, 3, static_cast<int>(points.size()), points.front().data(), False, command.data(),
                            nullptr, messages_) == qh_ERRnone;
    }

    std::string messages() {
        std::fflush(messages_);
        return std::string(text_, length_);
    }

    double volume() {
        qh_getarea(&qh_, qh_.facet_list);
        return qh_.totvol;
    }

    // The points used by faces, renumbered, with the faces as loops counter-clockwise seen from outside.
    Polyhedron polyhedron(const std::vector<Vec3d>& points) {
        qhT* qh = &qh_;  // the name that qhull's macros expect
        Polyhedron out;
        std::map<int, int> numbers;
        facetT* facet;
        FORALLfacets {
            std::vector<int> loop;
            setT* ordered = qh_facet3vertex(qh, facet);
            vertexT* vertex;
            vertexT** vertexp;
            FOREACHvertex_(ordered) {
                const int id = qh_pointid(qh, vertex->point);
                const auto [found, isNew] = numbers.emplace(id, static_cast<int>(out.vertices.size()));
                if (isNew) {
                    out.vertices.push_back(points[static_cast<std::size_t>(id)]);
                }
                loop.push_back(found->second);
            }
            qh_settempfree(qh, &ordered);
            Vec3d turn = Vec3d::Zero();
            for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
                const auto at = [&](std::size_t k) -> const Vec3d& {
                    return out.vertices[static_cast<std::size_t>(loop[k])];
                };
                turn += (at(i) - at(0)).cross(at(i + 1) - at(0));
            }
            if (turn.dot(Vec3d(facet->normal[0], facet->normal[1], facet->normal[2])) < 0) {
                std::reverse(loop.begin(), loop.end());
            }
            out.faces.push_back(std::move(loop));
        }
        return out;
    }

private:
    qhT qh_{};
    FILE* messages_ = nullptr;
    char* text_ = nullptr;
    std::size_t length_ = 0;
};

std::string text(const Vec3d& v) {
    return "(" + digits(v.x()) + ", " + digits(v.y()) + ", " + digits(v.z()) + ")";
}

double sizeOf(const std::vector<Vec3d>& points) {
    Vec3d low = points.front();
    Vec3d high = low;
    for (const Vec3d& p : points) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    return (high - low).norm();
}

// The first point of each group of points that are closer together than `distance` along every axis.
std::vector<Vec3d> withoutDoubles(const std::vector<Vec3d>& points, double distance) {
    std::vector<Vec3d> kept;
    std::map<std::array<std::int64_t, 3>, std::vector<std::size_t>> cells;
    const Vec3d origin = points.front();
    for (const Vec3d& p : points) {
        const Vec3d cell = ((p - origin) / distance).array().floor();
        const std::array<std::int64_t, 3> home = {static_cast<std::int64_t>(cell.x()),
                                                  static_cast<std::int64_t>(cell.y()),
                                                  static_cast<std::int64_t>(cell.z())};
        bool isDouble = false;
        for (int neighbour = 0; neighbour < 27 && !isDouble; ++neighbour) {
            const auto found =
                cells.find({home[0] + neighbour % 3 - 1, home[1] + neighbour / 3 % 3 - 1, home[2] + neighbour / 9 - 1});
            isDouble = found != cells.end() &&
                       std::any_of(found->second.begin(), found->second.end(),
                                   [&](std::size_t i) { return (kept[i] - p).cwiseAbs().maxCoeff() < distance; });
        }
        if (!isDouble) {
            cells[home].push_back(kept.size());
            kept.push_back(p);
        }
    }
    return kept;
}

template <class Measure>
std::size_t farthest(const std::vector<Vec3d>& points, const Measure& measure) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < points.size(); ++i) {
        best = measure(points[i]) > measure(points[best]) ? i : best;
    }
    return best;
}

// Four points far apart: ends, farthest from their line, farthest from that plane. Throws when there is no volume.
std::array<std::size_t, 4> simplex(const std::vector<Vec3d>& points, double size) {
    const auto fail = [&](const char* what) {
        throw InputError("points", std::to_string(points.size()) + " " + what,
                         "a hull needs four points that are not in one plane; use a thin box for a plate");
    };
    const std::size_t a = farthest(points, [&](const Vec3d& p) { return (p - points.front()).norm(); });
    const std::size_t b = farthest(points, [&](const Vec3d& p) { return (p - points[a]).norm(); });
    const Vec3d along = (points[b] - points[a]).normalized();
    const auto offLine = [&](const Vec3d& p) { return (p - points[a]).cross(along).norm(); };
    const std::size_t c = farthest(points, offLine);
    if (offLine(points[c]) <= closeness * size) {
        fail("on one line");
    }
    const Vec3d normal = along.cross(points[c] - points[a]).normalized();
    const auto offPlane = [&](const Vec3d& p) { return std::abs((p - points[a]).dot(normal)); };
    const std::size_t d = farthest(points, offPlane);
    if (offPlane(points[d]) <= closeness * size) {
        fail("in one plane");
    }
    return {a, b, c, d};
}

Polyhedron enclose(std::vector<Vec3d> points, const std::string& command) {
    Qhull qhull;
    if (!qhull.run(points, command)) {
        throw InputError("points", std::to_string(points.size()) + " of them", "qhull: " + qhull.messages());
    }
    return qhull.polyhedron(points);
}

// hull() joins faces that lie in one plane within its tolerance. Where qhull's facets, joined only as far as rounding
// asks for, are cut too badly for that, qhull joins them itself.
Shape makeShape(const std::vector<Vec3d>& points, double size) {
    const auto attempt = [&](const std::string& command) {
        Polyhedron p = enclose(points, command);
        return hull(std::move(p.vertices), std::move(p.faces));
    };
    try {
        return attempt("qhull");
    } catch (const InputError&) {
        char joined[48];
        std::snprintf(joined, sizeof joined, "qhull C%.3g", closeness * size);
        return attempt(joined);
    }
}

// Each time the point that is farthest outside the hull of those chosen so far.
std::vector<Vec3d> simplified(const std::vector<Vec3d>& points, double size, std::size_t count) {
    std::vector<Vec3d> chosen;
    for (const std::size_t i : simplex(points, size)) {
        chosen.push_back(points[i]);
    }
    while (chosen.size() < count) {
        const Polyhedron p = enclose(chosen, "qhull Qt");
        const auto outside = [&](const Vec3d& point) {
            double farthestOut = -1;
            for (const std::vector<int>& face : p.faces) {
                const Vec3d& a = p.vertices[static_cast<std::size_t>(face[0])];
                const Vec3d& b = p.vertices[static_cast<std::size_t>(face[1])];
                const Vec3d& c = p.vertices[static_cast<std::size_t>(face[2])];
                farthestOut = std::max(farthestOut, (b - a).cross(c - a).normalized().dot(point - a));
            }
            return farthestOut;
        };
        const std::size_t next = farthest(points, outside);
        if (outside(points[next]) <= closeness * size) {
            break;
        }
        chosen.push_back(points[next]);
    }
    return chosen;
}

}  // namespace

Shape convexHull(const std::vector<Vec3d>& points, int maxVertices) {
    if (maxVertices != 0 && maxVertices < 4) {
        throw InputError("maxVertices", std::to_string(maxVertices), "give 0 for no limit, or at least 4");
    }
    if (points.size() < 4) {
        throw InputError("points", std::to_string(points.size()) + " of them", "a hull needs at least four points");
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!points[i].allFinite() || points[i].cwiseAbs().maxCoeff() > 1e9) {
            throw InputError("points[" + std::to_string(i) + "]", text(points[i]),
                             "give finite coordinates within 1e9 m");
        }
    }
    const double size = sizeOf(points);
    if (size < minShapeSize()) {
        throw InputError("points", "all within " + std::to_string(size) + " m",
                         "give points further apart, or scale the scene up");
    }
    const std::vector<Vec3d> distinct = withoutDoubles(points, closeness * size);
    simplex(distinct, size);
    Shape shape = makeShape(distinct, size);
    const auto farthestOut = static_cast<std::size_t>(maxVertices);
    if (farthestOut == 0 || shape.hull->vertices.size() <= farthestOut) {
        return shape;
    }
    return makeShape(simplified(shape.hull->vertices, size, farthestOut), size);
}

double convexHullVolume(const std::vector<Vec3d>& points) {
    if (points.size() < 4) {
        return 0;
    }
    Qhull qhull;
    std::vector<Vec3d> copy = points;
    return qhull.run(copy, "qhull Pp") ? qhull.volume() : 0;
}

}  // namespace cairn
