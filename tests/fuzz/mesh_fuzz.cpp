// Meshes, as files and as numbers. The first byte says which: a file of one of the kinds, a file of heights, or
// vertices and faces from which a mesh, a hull and a decomposition are made.
#include "tests/fuzz/input.hpp"

#include <cairn/assets/convex_decomposition.hpp>
#include <cairn/assets/convex_hull.hpp>
#include <cairn/assets/mesh_file.hpp>

#include <unistd.h>
#include <filesystem>
#include <fstream>
#include <string>

namespace cairn::fuzz {
namespace {

void requireSound(const TriangleMesh& mesh) {
    claim(!mesh.triangles.empty(), "a mesh that was read has a triangle");
    for (const auto& triangle : mesh.triangles) {
        for (const int corner : triangle) {
            claim(corner >= 0 && static_cast<std::size_t>(corner) < mesh.vertices.size(), "corners are vertices");
        }
    }
    for (const Vec3d& vertex : mesh.vertices) {
        claim(vertex.allFinite(), "vertices are finite");
    }
}

template <class Act>
void attempt(Act act) {
    try {
        act();
    } catch (const InputError&) {
        // What bad input is answered with.
    }
}

// Of this process, for as long as it runs.
struct OwnFolder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("cairn_mesh_fuzz_" + std::to_string(getpid()));
    OwnFolder() { std::filesystem::create_directories(path); }
    OwnFolder(const OwnFolder&) = delete;
    OwnFolder& operator=(const OwnFolder&) = delete;
    ~OwnFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

void readFile(const char* ending, const std::uint8_t* data, std::size_t size) {
    static const OwnFolder folder;
    const std::filesystem::path file = folder.path / (std::string("mesh.") + ending);
    {
        std::ofstream stream(file, std::ios::binary);
        stream.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    }
    attempt([&] {
        if (std::string(ending) == "csv") {
            for (const std::vector<double>& row : loadHeights(file)) {
                claim(!row.empty(), "a row of heights has some");
            }
        } else {
            requireSound(loadMesh(file));
        }
    });
    std::filesystem::remove(file);
}

void makeShapes(Input input) {
    TriangleMesh mesh;
    const std::size_t vertices = input.below(24);
    const bool isWild = input.flag();
    for (std::size_t k = 0; k < vertices; ++k) {
        Vec3d v = input.vectorWithin(2);
        if (isWild) {
            v[static_cast<int>(k % 3)] = input.anything();
        }
        mesh.vertices.push_back(v);
    }
    std::vector<std::vector<int>> faces;
    const auto corner = [&] { return static_cast<int>(input.byte() % (vertices + 2)) - 1; };
    for (std::size_t k = input.below(40); k > 0; --k) {
        const int a = corner();
        const int b = corner();
        mesh.triangles.push_back({a, b, corner()});
        faces.push_back({mesh.triangles.back().begin(), mesh.triangles.back().end()});
    }
    attempt([&] { validate(cairn::mesh(mesh)); });
    attempt([&] { validate(hull(mesh.vertices, faces)); });
    attempt([&] { validate(convexHull(mesh.vertices, static_cast<int>(input.below(8)))); });
    attempt([&] {
        const Decomposition parts = decompose(mesh, {.maxHulls = 4, .resolution = 8});
        claim(!parts.hulls.empty() && std::isfinite(parts.hullVolume), "a solid has parts");
    });
    std::vector<double> heights;
    const int columns = static_cast<int>(input.below(5));
    const int rows = static_cast<int>(input.below(5));
    for (int k = 0; k < columns * rows; ++k) {
        heights.push_back(input.anything());
    }
    attempt([&] { validate(heightField(columns, rows, heights, input.anything())); });
}

}  // namespace
}  // namespace cairn::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) {
        return 0;
    }
    static constexpr std::array<const char*, 5> endings = {"obj", "stl", "glb", "gltf", "csv"};
    const std::size_t kind = data[0] % (endings.size() + 1);
    if (kind < endings.size()) {
        cairn::fuzz::readFile(endings[kind], data + 1, size - 1);
    } else {
        cairn::fuzz::makeShapes(cairn::fuzz::Input(data + 1, size - 1));
    }
    return 0;
}
