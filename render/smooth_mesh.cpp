#include "render/smooth_mesh.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// The number of each vertex's place: vertices at one place count as one, however often the file repeats them.
std::vector<std::size_t> placesOf(const TriangleMesh& mesh, std::size_t& count) {
    std::vector<int> order(mesh.vertices.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        order[i] = static_cast<int>(i);
    }
    const auto key = [&](int i) {
        const Vec3d& v = mesh.vertices[static_cast<std::size_t>(i)];
        return std::array<double, 3>{v.x(), v.y(), v.z()};
    };
    std::sort(order.begin(), order.end(), [&](int i, int j) {
        const auto a = key(i);
        const auto b = key(j);
        return a != b ? a < b : i < j;
    });
    std::vector<std::size_t> place(order.size());
    count = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i > 0 && key(order[i]) != key(order[i - 1])) {
            ++count;
        }
        place[static_cast<std::size_t>(order[i])] = count;
    }
    ++count;
    return place;
}

}  // namespace

SmoothMesh withNormals(const TriangleMesh& mesh, double crease) {
    const double creaseCosine = std::cos(crease);
    std::size_t places = 0;
    const std::vector<std::size_t> place = placesOf(mesh, places);

    struct Corner {
        std::size_t triangle;
        double angle;
    };
    std::vector<Vec3d> faceNormal(mesh.triangles.size(), Vec3d::Zero());
    std::vector<std::vector<Corner>> around(places);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        std::array<Vec3d, 3> p;
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][k])];
        }
        const Vec3d area = (p[1] - p[0]).cross(p[2] - p[0]);
        if (!(area.norm() > 0)) {
            continue;
        }
        faceNormal[t] = area.normalized();
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d a = p[(k + 1) % 3] - p[k];
            const Vec3d b = p[(k + 2) % 3] - p[k];
            const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
            around[place[static_cast<std::size_t>(mesh.triangles[t][k])]].push_back({t, angle});
        }
    }

    SmoothMesh out;
    // One place has few different normals; vertices that agree in both are shared.
    std::vector<std::vector<std::uint32_t>> made(places);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (faceNormal[t].isZero()) {
            continue;  // a triangle without area covers no pixel
        }
        for (const int index : mesh.triangles[t]) {
            const std::size_t at = place[static_cast<std::size_t>(index)];
            Vec3d sum = Vec3d::Zero();
            for (const Corner& corner : around[at]) {
                if (faceNormal[corner.triangle].dot(faceNormal[t]) >= creaseCosine) {
                    sum += corner.angle * faceNormal[corner.triangle];
                }
            }
            const Vec3f position = mesh.vertices[static_cast<std::size_t>(index)].cast<float>();
            const Vec3f normal = sum.normalized().cast<float>();
            const auto same = std::find_if(made[at].begin(), made[at].end(),
                                           [&](std::uint32_t i) { return out.vertices[i].normal == parts(normal); });
            if (same != made[at].end()) {
                out.indices.push_back(*same);
                continue;
            }
            made[at].push_back(static_cast<std::uint32_t>(out.vertices.size()));
            out.indices.push_back(made[at].back());
            out.vertices.push_back({parts(position), parts(normal)});
        }
    }
    return out;
}

}  // namespace cairn
