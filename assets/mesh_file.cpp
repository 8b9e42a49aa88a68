#include <cairn/assets/mesh_file.hpp>

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

namespace cairn {

namespace {

// assimp reads forty formats; these are the ones whose readers stood up to thousands of damaged files.
constexpr std::array allowed = {".obj", ".stl", ".glb", ".gltf"};

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& value, const std::string& remedy) {
    throw InputError(file.string(), value, remedy);
}

std::string kindOf(const std::filesystem::path& file) {
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

void requireAllowed(const std::filesystem::path& file) {
    const std::string extension = kindOf(file);
    if (std::find(allowed.begin(), allowed.end(), extension) == allowed.end()) {
        fail(file, extension.empty() ? "(no extension)" : extension,
             "mesh files are read as obj, stl, glb or gltf only; save it as one of these");
    }
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored)) {
        fail(file, "(no such file)", "check the path; relative ones start beside the scene file");
    }
}

// Before any of assimp's own steps sees them: these sort and index without looking.
void requireSound(const std::filesystem::path& file, const aiMesh& mesh) {
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
        const aiVector3D& v = mesh.mVertices[i];
        if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) {
            fail(file, "vertex " + std::to_string(i) + " is not finite", "mend the coordinate in the file");
        }
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        const aiFace& face = mesh.mFaces[f];
        for (unsigned k = 0; k < face.mNumIndices; ++k) {
            if (face.mIndices[k] >= mesh.mNumVertices) {
                fail(file, "face " + std::to_string(f) + " names vertex " + std::to_string(face.mIndices[k]),
                     "there are " + std::to_string(mesh.mNumVertices) + " vertices; mend the face in the file");
            }
        }
    }
}

const aiScene& sound(const std::filesystem::path& file, Assimp::Importer& importer, const aiScene* scene) {
    if (scene == nullptr || (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0 || scene->mRootNode == nullptr) {
        const std::string why = importer.GetErrorString();
        fail(file, "(not readable as a mesh)", why.empty() ? "it holds no mesh" : why);
    }
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        requireSound(file, *scene->mMeshes[m]);
    }
    return *scene;
}

// How many triangles a glTF file says it holds; its text stands alone (.gltf) or behind 20 bytes of header (.glb).
std::size_t promisedTriangles(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    constexpr std::size_t header = 20;
    if (kindOf(file) == ".glb" && text.size() > header) {
        std::uint32_t length = 0;
        std::memcpy(&length, text.data() + 12, sizeof length);  // of the JSON chunk, little-endian
        text = text.substr(header, length);
    }
    const nlohmann::json document = nlohmann::json::parse(text);
    std::size_t triangles = 0;
    for (const auto& mesh : document.at("meshes")) {
        for (const auto& primitive : mesh.at("primitives")) {
            constexpr int list = 4;
            constexpr int fan = 6;
            const int mode = primitive.value("mode", list);
            const auto& source =
                primitive.contains("indices") ? primitive.at("indices") : primitive.at("attributes").at("POSITION");
            const auto corners = document.at("accessors").at(source.get<std::size_t>()).at("count").get<std::size_t>();
            if (mode == list) {
                triangles += corners / 3;
            } else if (mode > list && mode <= fan && corners > 2) {  // strips and fans
                triangles += corners - 2;
            }
        }
    }
    return triangles;
}

// assimp leaves out a glTF triangle whose index is out of range, with a warning that only its log shows.
void requireAllTriangles(const std::filesystem::path& file, const aiScene& scene) {
    if (kindOf(file) != ".glb" && kindOf(file) != ".gltf") {
        return;
    }
    std::size_t triangles = 0;
    for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
        const aiMesh& mesh = *scene.mMeshes[m];
        triangles += static_cast<std::size_t>(std::count_if(mesh.mFaces, mesh.mFaces + mesh.mNumFaces,
                                                            [](const aiFace& face) { return face.mNumIndices == 3; }));
    }
    const std::size_t promised = promisedTriangles(file);
    if (triangles < promised) {
        fail(file, std::to_string(triangles) + " of " + std::to_string(promised) + " triangles are sound",
             "an index of the others is out of range; mend them in the file");
    }
}

// Gathers triangles; equal vertices become one, so that neighbours know each other.
class Welder {
public:
    explicit Welder(TriangleMesh& out) : out_(out) {}

    int vertex(const Vec3d& v) {
        const std::array<double, 3> key = {v.x() + 0.0, v.y() + 0.0, v.z() + 0.0};  // -0 + 0 is 0
        const auto [found, isNew] = seen_.emplace(key, static_cast<int>(out_.vertices.size()));
        if (isNew) {
            out_.vertices.emplace_back(key[0], key[1], key[2]);
        }
        return found->second;
    }

private:
    TriangleMesh& out_;
    std::map<std::array<double, 3>, int> seen_;
};

bool hasArea(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    constexpr double sliver = 1e-9;  // height over longest side
    return (b - a).cross(c - a).norm() > sliver * longest * longest;
}

TriangleMesh trianglesOf(const std::filesystem::path& file, const aiScene& scene, double scale) {
    TriangleMesh all;
    Welder welder(all);
    const auto point = [scale](const aiVector3D& v) {
        return Vec3d(scale * static_cast<double>(v.x), scale * static_cast<double>(v.y),
                     scale * static_cast<double>(v.z));
    };
    for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
        const aiMesh& mesh = *scene.mMeshes[m];
        for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
            const aiFace& face = mesh.mFaces[f];
            if (face.mNumIndices != 3) {
                continue;  // points and lines have no surface
            }
            const Vec3d a = point(mesh.mVertices[face.mIndices[0]]);
            const Vec3d b = point(mesh.mVertices[face.mIndices[1]]);
            const Vec3d c = point(mesh.mVertices[face.mIndices[2]]);
            if (hasArea(a, b, c)) {
                // In a sequence of its own: the order of evaluation in a list of arguments is not fixed.
                const int ia = welder.vertex(a);
                const int ib = welder.vertex(b);
                const int ic = welder.vertex(c);
                all.triangles.push_back({ia, ib, ic});
            }
        }
    }
    if (all.triangles.empty()) {
        fail(file, "(no triangle with area)", "save a mesh with faces into it");
    }
    return all;
}

}  // namespace

TriangleMesh loadMesh(const std::filesystem::path& file, double scale) {
    requireAllowed(file);
    if (!std::isfinite(scale) || scale <= 0) {
        fail(file, "scale " + std::to_string(scale), "give a finite factor above 0");
    }
    try {
        Assimp::Importer importer;
        // FindInvalidData would drop a whole object for one bad vertex, and JoinIdenticalVertices keeps apart what
        // differs in normal or texture: both are done here instead.
        const aiScene* read = importer.ReadFile(file.string(), aiProcess_ValidateDataStructure);
        requireAllTriangles(file, sound(file, importer, read));
        const aiScene* triangulated =
            importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_PreTransformVertices);
        return trianglesOf(file, sound(file, importer, triangulated), scale);
    } catch (const InputError&) {
        throw;
    } catch (const std::exception& error) {  // bad_alloc and assimp's own, from damaged files
        fail(file, "(not readable as a mesh)", error.what());
    }
}

}  // namespace cairn
