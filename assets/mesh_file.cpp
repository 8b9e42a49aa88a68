#include <cairn/assets/mesh_file.hpp>

#include "assets/input_file.hpp"
#include "assets/located_error.hpp"
#include "assets/mesh_content.hpp"
#include "base/digits.hpp"

#include <assimp/BaseImporter.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <algorithm>
#include <array>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <list>
#include <map>

namespace cairn {

namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& value, const std::string& remedy) {
    throw InputError(file.string(), value, remedy);
}

// Shows assimp the file, whose bytes are here, and of glTF the files beside it that hold its buffers. Nothing else is
// opened: an OBJ's materials say nothing of its shape.
class FencedFiles : public Assimp::IOSystem {
public:
    FencedFiles(const std::filesystem::path& file, MeshKind kind, const std::string& bytes)
        : file_(file), hasBuffers_(kind == MeshKind::Gltf), bytes_(bytes) {}

    bool Exists(const char* name) const override {
        std::error_code error;
        return name == file_ || (mayOpen(name) && std::filesystem::is_regular_file(name, error));
    }
    char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* name, const char* mode) override {
        if (std::strchr(mode, 'w') != nullptr || (name != file_ && !mayOpen(name))) {
            return nullptr;
        }
        if (name == file_) {
            return streamOf(bytes_);
        }
        try {
            return streamOf(buffers_.emplace_back(readInputFile(name)));
        } catch (const InputError&) {
            return nullptr;
        }
    }
    void Close(Assimp::IOStream* stream) override { delete stream; }

private:
    bool mayOpen(const std::filesystem::path& name) const { return hasBuffers_ && isWithin(file_.parent_path(), name); }
    static Assimp::IOStream* streamOf(const std::string& bytes) {
        return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    }

    std::filesystem::path file_;
    bool hasBuffers_;
    const std::string& bytes_;
    std::list<std::string> buffers_;  // a stream reads in place
};

// assimp goes by what a file looks like where its ending finds no reader: only the one reader may be there.
void keepReader(Assimp::Importer& importer, MeshKind kind) {
    const std::string_view kept = kind == MeshKind::Obj   ? "Wavefront Object Importer"
                                  : kind == MeshKind::Stl ? "Stereolithography (STL) Importer"
                                                          : "glTF2 Importer";
    for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
        const aiImporterDesc* const about = importer.GetImporterInfo(i);
        Assimp::BaseImporter* const reader = importer.GetImporter(i);
        if (about == nullptr || about->mName != kept) {
            importer.UnregisterLoader(reader);
            delete reader;
        }
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
        if (why == std::bad_alloc().what()) {
            throw std::bad_alloc();
        }
        fail(file, "(not readable as a mesh)", why.empty() ? "it holds no mesh" : why);
    }
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        requireSound(file, *scene->mMeshes[m]);
    }
    return *scene;
}

// assimp leaves out a glTF triangle whose index is out of range, with a warning that only its log shows.
void requireAllTriangles(const std::filesystem::path& file, const aiScene& scene, std::size_t promised) {
    std::size_t triangles = 0;
    for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
        const aiMesh& mesh = *scene.mMeshes[m];
        triangles += static_cast<std::size_t>(std::count_if(mesh.mFaces, mesh.mFaces + mesh.mNumFaces,
                                                            [](const aiFace& face) { return face.mNumIndices == 3; }));
    }
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
    const MeshKind kind = meshKind(file);
    if (!std::isfinite(scale) || scale <= 0) {
        fail(file, "scale " + digits(scale), "give a finite factor above 0");
    }
    const std::string bytes = readInputFile(file);
    requireContent(file, kind, bytes);
    try {
        Assimp::Importer importer;
        keepReader(importer, kind);
        importer.SetIOHandler(new FencedFiles(file, kind, bytes));
        // FindInvalidData would drop a whole object for one bad vertex, and JoinIdenticalVertices keeps apart what
        // differs in normal or texture: both are done here instead.
        const aiScene* read = importer.ReadFile(file.string(), aiProcess_ValidateDataStructure);
        requireAllTriangles(file, sound(file, importer, read), promisedTriangles(kind, bytes));
        const aiScene* triangulated =
            importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_PreTransformVertices);
        return trianglesOf(file, sound(file, importer, triangulated), scale);
    } catch (const InputError&) {
        throw;
    } catch (const std::bad_alloc&) {
        fail(file, "(not readable as a mesh)",
             "reading it takes more memory than there is: it is damaged, or too large");
    } catch (const std::exception& error) {  // assimp's own, from damaged files
        fail(file, "(not readable as a mesh)", error.what());
    }
}

}  // namespace cairn
