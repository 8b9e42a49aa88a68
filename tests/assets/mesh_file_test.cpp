// Mesh files of each kind, sound and damaged.
#include <cairn/assets.hpp>

#include "tests/assets/temp_dir.hpp"

#include <sys/stat.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <random>

namespace cairn::test {
namespace {

constexpr double pi = std::numbers::pi;

const Vec3d& corner(const TriangleMesh& mesh, const std::array<int, 3>& triangle, std::size_t k) {
    return mesh.vertices[static_cast<std::size_t>(triangle[k])];
}

// By the divergence theorem: right for a closed surface wound outwards.
double volume(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
        sum += corner(mesh, t, 0).dot(corner(mesh, t, 1).cross(corner(mesh, t, 2))) / 6;
    }
    return sum;
}

bool isClosed(const TriangleMesh& mesh) {
    std::map<std::pair<int, int>, int> edges;
    for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            ++edges[{t[k], t[(k + 1) % 3]}];
        }
    }
    for (const auto& [edge, count] : edges) {
        if (count != 1 || !edges.contains({edge.second, edge.first})) {
            return false;
        }
    }
    return true;
}

std::string errorOf(const std::filesystem::path& file, double scale = 1) {
    try {
        loadMesh(file, scale);
    } catch (const InputError& error) {
        EXPECT_EQ(error.field(), file.string());
        return error.what();
    }
    return "(accepted)";
}

TEST(MeshFile, GlbCubeHasEightCornersAndItsNodesTransform) {
    const TriangleMesh cube = loadMesh(dataFile("cube.glb"));
    EXPECT_EQ(cube.vertices.size(), 8U);
    EXPECT_EQ(cube.triangles.size(), 12U);
    EXPECT_TRUE(isClosed(cube));
    EXPECT_NEAR(volume(cube), 1, 1e-12);
    for (const Vec3d& v : cube.vertices) {
        EXPECT_EQ(std::abs(v.x()), 0.5);
        EXPECT_TRUE(v.y() == 0 || v.y() == 1);
    }
}

TEST(MeshFile, ScaleIsAppliedToCoordinates) {
    EXPECT_NEAR(volume(loadMesh(dataFile("cube.glb"), 0.25)), 1.0 / 64, 1e-12);
}

TEST(MeshFile, StlStairsHaveTheirVolume) {
    const TriangleMesh stairs = loadMesh(dataFile("stairs.stl"));
    EXPECT_NEAR(volume(stairs), 1.6 * 0.3 * 0.17 * 21, 1e-6);  // 6 steps: 1 + 2 + ... + 6 blocks
}

TEST(MeshFile, ObjBowlIsClosedAndHollow) {
    const TriangleMesh bowl = loadMesh(dataFile("bowl.obj"));
    EXPECT_TRUE(isClosed(bowl));
    const double round = 2.0 / 3 * pi * (std::pow(0.56, 3) - std::pow(0.5, 3));
    EXPECT_LT(volume(bowl), round);
    EXPECT_GT(volume(bowl), 0.96 * round);  // 24 x 6 facets
}

TEST(MeshFile, ObjRockIsClosed) {
    const TriangleMesh rock = loadMesh(dataFile("rock.obj"));
    EXPECT_TRUE(isClosed(rock));
    EXPECT_EQ(rock.vertices.size(), 42U);
    EXPECT_EQ(rock.triangles.size(), 80U);
    EXPECT_GT(volume(rock), 0.03);
}

TEST(MeshFile, ObjVoussoirHasItsVolume) {
    const TriangleMesh stone = loadMesh(dataFile("voussoir.obj"));
    EXPECT_TRUE(isClosed(stone));
    EXPECT_NEAR(volume(stone), 0.5 * (1.3 * 1.3 - 1) * std::sin(pi / 9) * 0.4, 1e-6);
}

TEST(MeshFile, BinaryAndTextStlAgree) {
    // Written here: 80 bytes of header, count, then 12 floats and 2 bytes a triangle.
    const TriangleMesh stairs = loadMesh(dataFile("stairs.stl"));
    std::string bytes(80, ' ');
    const auto count = static_cast<std::uint32_t>(stairs.triangles.size());
    bytes.append(reinterpret_cast<const char*>(&count), 4);
    for (const auto& t : stairs.triangles) {
        bytes.append(12, '\0');
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f v = corner(stairs, t, k).cast<float>();
            bytes.append(reinterpret_cast<const char*>(v.data()), 12);
        }
        bytes.append(2, '\0');
    }
    const auto file = std::filesystem::temp_directory_path() / "cairn_binary_stairs.stl";
    std::ofstream(file, std::ios::binary) << bytes;
    const TriangleMesh back = loadMesh(file);
    std::filesystem::remove(file);
    EXPECT_EQ(back.triangles, stairs.triangles);
    EXPECT_EQ(back.vertices, stairs.vertices);
}

class MeshFiles : public TempDir {};

const char* const tetrahedron = R"(v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
)";

TEST_F(MeshFiles, PolygonsBecomeTrianglesAndDoublesOne) {
    const TriangleMesh plate = loadMesh(write("plate.obj",
                                              "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 0\nv -1 1 0\n"
                                              "f 1 2 3 4\nf 5 4 6\n"));
    EXPECT_EQ(plate.vertices.size(), 5U);
    EXPECT_EQ(plate.triangles.size(), 3U);
}

TEST_F(MeshFiles, TrianglesWithoutAreaAreLeftOut) {
    const std::string text = std::string(tetrahedron) + "v 2 0 0\nf 1 2 5\nf 1 1 2\n";
    const TriangleMesh mesh = loadMesh(write("t.obj", text));
    EXPECT_EQ(mesh.triangles.size(), 4U);
    EXPECT_EQ(mesh.vertices.size(), 4U);
    EXPECT_NEAR(volume(mesh), 1.0 / 6, 1e-12);
}

TEST_F(MeshFiles, CapitalExtensionAndOddNamesLoad) {
    EXPECT_EQ(loadMesh(write("A rock.OBJ", tetrahedron)).triangles.size(), 4U);
}

TEST_F(MeshFiles, GltfWithItsBufferInside) {
    // One triangle (0,0,0) (1,0,0) (0,1,0), its nine floats in base64.
    const std::string gltf = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [2, 2, 2]}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}]})";
    const TriangleMesh triangle = loadMesh(write("t.gltf", gltf));
    ASSERT_EQ(triangle.triangles.size(), 1U);
    EXPECT_EQ(corner(triangle, triangle.triangles[0], 1), Vec3d(2, 0, 0));
}

TEST_F(MeshFiles, OtherKindsAreRefusedInWords) {
    EXPECT_NE(errorOf(write("m.ply", "ply\n")).find(".ply: mesh files are read as obj, stl, glb or gltf only"),
              std::string::npos);
    EXPECT_NE(errorOf(write("mesh", tetrahedron)).find("(no extension)"), std::string::npos);
    EXPECT_NE(errorOf(dir() / "none.obj").find("no such file"), std::string::npos);
    std::filesystem::create_directory(dir() / "folder.obj");
    EXPECT_NE(errorOf(dir() / "folder.obj").find("a folder"), std::string::npos);
    EXPECT_NE(errorOf(write("t.obj", tetrahedron), -1e-9).find("scale -1e-09: give a finite factor above 0"),
              std::string::npos);
    EXPECT_NE(errorOf(write("t.obj", tetrahedron), std::nan("")).find("finite factor above 0"), std::string::npos);
}

// assimp takes a file for what its first bytes say: this one reached the PLY reader, which crashed or never ended.
TEST_F(MeshFiles, BytesOfAnotherKindAreRefused) {
    const std::string ply =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_index\nend_head\xf2\n" +
        std::string(49, '\0');
    for (const char* const name : {"a.glb", "a.gltf", "a.stl", "a.obj"}) {
        EXPECT_NE(errorOf(write(name, ply)).find("(not readable as a mesh)"), std::string::npos) << name;
        EXPECT_NE(errorOf(write(name, "ply\nformat binary_li")), "(accepted)") << name;
    }
    EXPECT_NE(errorOf(write("b.glb", readAll(dataFile("rock.obj")))).find("does not begin as a .glb"),
              std::string::npos);
    EXPECT_NE(errorOf(write("b.stl", readAll(dataFile("cube.glb")))).find("too short"), std::string::npos);
}

// Of 43 bytes, which took 4 GB.
TEST_F(MeshFiles, PromisesBeyondTheFileAreRefused) {
    const std::string glb("glTF\2\0\0\0\x18\3\0\0\xff\xff\xff\xffJSON{\"a\x99\\\nve\x9dsion\":\"2.0#\",\"", 43);
    EXPECT_NE(errorOf(write("a.glb", glb)).find("says that it has 792 bytes, and has 43"), std::string::npos);
    std::string chunk = readAll(dataFile("cube.glb"));
    chunk[15] = '\x7f';
    EXPECT_NE(errorOf(write("b.glb", chunk)).find("a part of it says that it has 21"), std::string::npos);
    const std::string gltf = R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 36}],
        "accessors": [{"componentType": 5126, "count": 4000000000, "type": "VEC3"}]})";
    EXPECT_NE(errorOf(write("c.gltf", gltf)).find("counts 4000000000 elements, and its buffers have 36"),
              std::string::npos);
    EXPECT_NE(errorOf(write("d.gltf", std::string(100000, '['))).find("nested too deep"), std::string::npos);
}

TEST_F(MeshFiles, PipesAreNotWaitedFor) {
    ASSERT_EQ(mkfifo((dir() / "pipe.obj").c_str(), 0600), 0);
    EXPECT_NE(errorOf(dir() / "pipe.obj").find("a pipe or device"), std::string::npos);
    ASSERT_EQ(mkfifo((dir() / "pipe.mtl").c_str(), 0600), 0);
    const std::string text = std::string("mtllib pipe.mtl\nusemtl a\n") + tetrahedron;
    EXPECT_EQ(loadMesh(write("t.obj", text)).triangles.size(), 4U);
}

// A triangle, whose corners lie in a file of their own.
std::string gltfWithBuffer(const std::string& uri) {
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": 36, "uri": ")" +
           uri + R"("}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}]})";
}

TEST_F(MeshFiles, BuffersOfGltfLieInItsFolder) {
    const std::array<float, 9> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::string bytes(reinterpret_cast<const char*>(corners.data()), sizeof corners);
    std::filesystem::create_directory(dir() / "in");
    write("in/corners.bin", bytes);
    write("outside.bin", bytes);
    std::filesystem::create_symlink("../outside.bin", dir() / "in" / "link.bin");
    ASSERT_EQ(mkfifo((dir() / "in" / "pipe.bin").c_str(), 0600), 0);
    EXPECT_EQ(loadMesh(write("in/t.gltf", gltfWithBuffer("corners.bin"))).triangles.size(), 1U);
    for (const std::string uri : {"../outside.bin", "link.bin", "pipe.bin", "/dev/zero"}) {
        const std::string said = errorOf(write("in/t.gltf", gltfWithBuffer(uri)));
        EXPECT_NE(said.find("could not open referenced file"), std::string::npos) << uri << ": " << said;
    }
}

TEST_F(MeshFiles, EmptyAndMeaninglessFilesAreRefused) {
    for (const char* name : {"e.obj", "e.stl", "e.glb", "e.gltf"}) {
        EXPECT_NE(errorOf(write(name, "")), "(accepted)") << name;
        EXPECT_NE(errorOf(write(name, "This is not a mesh.\n")), "(accepted)") << name;
    }
    EXPECT_NE(errorOf(write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n")), "(accepted)");
    EXPECT_NE(errorOf(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")).find("no triangle with area"),
              std::string::npos);
}

TEST_F(MeshFiles, CoordinatesMustBeFinite) {
    for (const char* bad : {"nan", "inf", "1e999"}) {
        const std::string text = std::string(tetrahedron) + "v " + bad + " 0 2\nf 1 2 5\n";
        EXPECT_NE(errorOf(write("bad.obj", text)).find("not finite"), std::string::npos) << bad;
    }
    std::string stl = readAll(dataFile("stairs.stl"));
    stl.replace(stl.find("vertex ") + 7, 8, "nan     ");
    EXPECT_NE(errorOf(write("bad.stl", stl)), "(accepted)");
    std::string glb = readAll(dataFile("cube.glb"));
    const float nan = std::nanf("");
    std::memcpy(glb.data() + glb.find(std::string("BIN\0", 4)) + 4, &nan, 4);
    EXPECT_NE(errorOf(write("bad.glb", glb)).find("not finite"), std::string::npos);
}

TEST_F(MeshFiles, IndicesMustBeInRange) {
    EXPECT_NE(errorOf(write("bad.obj", std::string(tetrahedron) + "f 1 2 99\n")), "(accepted)");
    std::string glb = readAll(dataFile("cube.glb"));
    const std::uint16_t index = 9;  // of 8
    std::memcpy(glb.data() + glb.find(std::string("BIN\0", 4)) + 4 + 96, &index, 2);
    EXPECT_NE(errorOf(write("bad.glb", glb)).find("11 of 12 triangles"), std::string::npos);
}

TEST_F(MeshFiles, TruncatedFilesThrowOrLoad) {
    for (const char* name : {"rock.obj", "stairs.stl", "cube.glb"}) {
        const std::string whole = readAll(dataFile(name));
        for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 40) {
            errorOf(write(name, whole.substr(0, size)));
        }
    }
    EXPECT_NE(errorOf(write("half.glb", readAll(dataFile("cube.glb")).substr(0, 600))), "(accepted)");
}

// A damaged file is refused with an InputError or gives a sound mesh; nothing else comes out.
TEST_F(MeshFiles, MutatedFilesThrowOrLoad) {
    std::mt19937 chance(17);
    int loaded = 0;
    for (const char* name : {"rock.obj", "stairs.stl", "cube.glb"}) {
        const std::string whole = readAll(dataFile(name));
        for (int round = 0; round < 300; ++round) {
            std::string bytes = whole;
            for (unsigned edits = 1 + chance() % 4; edits > 0 && !bytes.empty(); --edits) {
                const std::size_t at = chance() % bytes.size();
                switch (chance() % 4) {
                    case 0:
                        bytes[at] = static_cast<char>(chance() % 256);
                        break;
                    case 1:
                        bytes.erase(at, 1 + chance() % 16);
                        break;
                    case 2:
                        bytes.insert(at, bytes.substr(chance() % bytes.size(), chance() % 64));
                        break;
                    default:
                        bytes[at] = "0123456789-./ \n"[chance() % 15];
                        break;
                }
            }
            const auto file = write(name, bytes);
            try {
                const TriangleMesh mesh = loadMesh(file);
                ++loaded;
                for (const Vec3d& v : mesh.vertices) {
                    ASSERT_TRUE(v.allFinite());
                }
                for (const auto& t : mesh.triangles) {
                    for (const int i : t) {
                        ASSERT_TRUE(i >= 0 && static_cast<std::size_t>(i) < mesh.vertices.size());
                    }
                }
            } catch (const InputError& error) {
                ASSERT_EQ(error.field(), file.string());
            }
        }
    }
    EXPECT_GT(loaded, 100);  // else the mutations test nothing but the first check
}

}  // namespace
}  // namespace cairn::test
