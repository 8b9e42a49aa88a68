// Scenes from files: names become ids, materials become shapes' surfaces, files become meshes.
#include <cairn/assets/convex_hull.hpp>
#include <cairn/assets/mesh_file.hpp>
#include <cairn/assets/scene_files.hpp>

#include "assets/input_file.hpp"
#include "assets/located_error.hpp"
#include "assets/nearest.hpp"
#include "assets/scene_file.hpp"
#include "base/digits.hpp"

#include <charconv>
#include <sstream>

namespace cairn {

namespace {

using namespace scene_file;
using Names = std::map<std::string, std::size_t>;

}  // namespace

std::vector<std::vector<double>> loadHeights(const std::filesystem::path& file, double scale) {
    const std::string text = readInputFile(file);
    std::vector<std::vector<double>> rows;
    std::istringstream lines(text);
    int lineNumber = 0;
    for (std::string line; std::getline(lines, line);) {
        ++lineNumber;
        std::vector<double> row;
        const char* at = line.data();
        const char* const end = at + line.size();
        while (true) {
            while (at != end && (*at == ' ' || *at == '\t' || *at == ',' || *at == ';' || *at == '\r')) {
                ++at;
            }
            if (at == end) {
                break;
            }
            double x = 0;
            const auto [next, error] = std::from_chars(at, end, x);
            if (error != std::errc() || std::isinf(x)) {
                throw InputError(
                    file.string() + ":" + std::to_string(lineNumber) + ":" + std::to_string(at - line.data() + 1),
                    quoted(std::string(at, std::min(at + 20, end))),
                    "give a finite number, or nan for a hole; commas or blanks part them");
            }
            row.push_back(scale * x);
            at = next;
        }
        if (!row.empty()) {
            rows.push_back(std::move(row));
        }
    }
    return rows;
}

namespace {

Shape fieldOf(const std::vector<std::vector<double>>& heights, double cellSize, const std::string& place) {
    const std::size_t rows = heights.size();
    if (rows < 2 || heights[0].size() < 2) {
        throw InputError(place, std::to_string(rows) + " rows of " + std::to_string(rows > 0 ? heights[0].size() : 0),
                         "give at least two rows of at least two heights");
    }
    const std::size_t columns = heights[0].size();
    std::vector<double> all;
    all.reserve(rows * columns);
    for (std::size_t row = 0; row < rows; ++row) {
        if (heights[row].size() != columns) {
            throw InputError(place + "/" + std::to_string(row), std::to_string(heights[row].size()) + " heights",
                             "give each row as many as the first one has: " + std::to_string(columns));
        }
        all.insert(all.end(), heights[row].begin(), heights[row].end());
    }
    return locate(place, [&] {
        return heightField(static_cast<int>(columns), static_cast<int>(rows), std::move(all), cellSize);
    });
}

// A file's structs made into a Scene. Places in errors are JSON pointers into that file.
class SceneMaker {
public:
    SceneMaker(SceneFile& file, const std::filesystem::path& base, const std::string& nameForErrors,
               const SceneFiles& files)
        : file_(file), base_(base), root_(nameForErrors + ":"), files_(files) {}

    Scene make() {
        Scene scene;
        scene.description = file_.description;
        scene.world = file_.world.def;
        scene.dt = file_.world.dt;
        scene.seconds = file_.seconds;
        scene.view = file_.view;
        if ((scene.view.eye - scene.view.target).norm() == 0) {
            throw InputError(root_ + "/view/target", "the same point as eye", "move one of the two");
        }
        for (std::size_t i = 0; i < file_.bodies.size(); ++i) {
            scene.bodies.push_back(body(i));
        }
        for (std::size_t i = 0; i < file_.joints.size(); ++i) {
            scene.joints.push_back(joint(i, scene));
        }
        for (std::size_t i = 0; i < file_.deformables.size(); ++i) {
            scene.deformables.push_back(deformable(i));
        }
        return scene;
    }

private:
    // Of a def as a whole, which the reader has not seen.
    static void complain(const std::string& place, const std::optional<Complaint>& wrong) {
        if (wrong) {
            throw InputError(place + "/" + wrong->field, wrong->value, wrong->remedy);
        }
    }

    static void addName(Names& names, const std::string& name, std::size_t index, const std::string& place) {
        if (name.empty()) {
            return;
        }
        const auto [found, isNew] = names.emplace(name, index);
        if (!isNew) {
            throw InputError(place + "/name", quoted(name),
                             "number " + std::to_string(found->second) + " in this list has it already; give another");
        }
    }

    BodyDef body(std::size_t index) {
        const std::string place = root_ + "/bodies/" + std::to_string(index);
        BodyFields& fields = file_.bodies[index];
        BodyDef def = fields.def;
        addName(bodyNames_, def.name, index, place);
        for (std::size_t i = 0; i < fields.shapes.size(); ++i) {
            def.shapes.push_back(shape(fields.shapes[i], place + "/shapes/" + std::to_string(i)));
        }
        complain(place, validate(def));
        return def;
    }

    Shape shape(const ShapeFields& fields, const std::string& place) {
        Shape made = geometry(fields, place);
        made.pose = fields.pose;
        if (!fields.material.empty()) {
            const auto found = file_.materials.find(fields.material);
            if (found == file_.materials.end()) {
                std::vector<std::string> known;
                for (const auto& [name, material] : file_.materials) {
                    known.push_back(name);
                }
                throw InputError(place + "/material", quoted(fields.material),
                                 "there is no such material; " + suggestion(fields.material, known));
            }
            made.material = found->second;
        }
        if (fields.friction) {
            made.material.friction = *fields.friction;
            made.material.staticFriction = Material{}.staticFriction;
        }
        made.material.staticFriction = fields.staticFriction.value_or(made.material.staticFriction);
        made.material.restitution = fields.restitution.value_or(made.material.restitution);
        made.material.rollingFriction = fields.rollingFriction.value_or(made.material.rollingFriction);
        made.material.spinningFriction = fields.spinningFriction.value_or(made.material.spinningFriction);
        made.material.density = fields.density.value_or(made.material.density);
        complain(place, validate(made.material));
        return made;
    }

    Shape geometry(const ShapeFields& s, const std::string& place) {
        if (s.box) {
            return locate(place + "/box", [&] { return box(s.box->halfExtents); });
        }
        if (s.sphere) {
            return locate(place + "/sphere", [&] { return sphere(s.sphere->radius); });
        }
        if (s.capsule) {
            return locate(place + "/capsule", [&] { return capsule(s.capsule->radius, s.capsule->halfHeight); });
        }
        if (s.cylinder) {
            return locate(place + "/cylinder", [&] { return cylinder(s.cylinder->radius, s.cylinder->halfHeight); });
        }
        if (s.cone) {
            return locate(place + "/cone", [&] { return cone(s.cone->radius, s.cone->halfHeight); });
        }
        if (s.ellipsoid) {
            return locate(place + "/ellipsoid", [&] { return ellipsoid(s.ellipsoid->radii); });
        }
        if (s.hull) {
            return hullOf(*s.hull, place + "/hull");
        }
        if (s.mesh) {
            const TriangleMesh triangles = meshOf(*s.mesh, place + "/mesh");
            return locate(place + "/mesh", [&] { return mesh(triangles); });
        }
        if (s.heightfield) {
            return heightfield(*s.heightfield, place + "/heightfield");
        }
        return locate(place + "/halfspace", [&] { return halfspace(*s.halfspace); });
    }

    // A file that the scene names. Whether it may is asked before whether there is one, so that no scene can find out.
    std::filesystem::path named(const std::string& name, const std::string& place) const {
        if (files_.none) {
            throw InputError(place, quoted(name), "no files are read here: write into this file what that one holds");
        }
        std::filesystem::path file = base_ / name;
        if (!isWithin(base_, file) && (files_.root.empty() || !isWithin(files_.root, file))) {
            throw InputError(place, quoted(name),
                             "it is outside of the scene's folder: copy it there, or allow its folder (--root FOLDER, "
                             "SceneFiles::root)");
        }
        return file;
    }

    TriangleMesh meshFrom(const std::string& name, double scale, const std::string& place) const {
        const std::filesystem::path file = named(name, place + "/file");
        return locate(place, [&] { return files_.readMesh ? files_.readMesh(file, scale) : loadMesh(file, scale); });
    }

    TriangleMesh meshOf(const MeshFields& s, const std::string& place) const {
        return s.file.empty() ? TriangleMesh{s.vertices, s.triangles} : meshFrom(s.file, s.scale, place);
    }

    Shape hullOf(const HullFields& s, const std::string& place) const {
        const std::vector<Vec3d> points = s.file.empty() ? s.points : meshFrom(s.file, s.scale, place).vertices;
        return locate(
            place, [&] { return s.vertices.empty() ? convexHull(points, s.maxVertices) : hull(s.vertices, s.faces); });
    }

    Shape heightfield(const HeightfieldFields& s, const std::string& place) const {
        std::vector<std::vector<double>> heights;
        if (!s.file.empty()) {
            const std::filesystem::path file = named(s.file, place + "/file");
            heights = locate(place + "/file", [&] { return loadHeights(file, s.scale); });
        }
        for (const std::vector<Height>& row : s.heights) {
            heights.emplace_back();
            for (const Height& height : row) {
                heights.back().push_back(s.scale * height.value);
            }
        }
        return fieldOf(heights, s.cellSize, place + (s.file.empty() ? "/heights" : "/file"));
    }

    static Shape halfspace(const HalfSpaceFields& s) {
        Shape made = halfSpace(s.normal, s.offset);
        // A unit normal is left as it is, so that what was written is read back to the last bit.
        constexpr double unitTolerance = 1e-12;
        if (std::abs(s.normal.norm() - 1) < unitTolerance) {
            made.size = s.normal;
        }
        return made;
    }

    std::size_t bodyIndex(const BodyRef& ref, const std::string& place) const {
        if (ref.index >= 0) {
            const auto index = static_cast<std::size_t>(ref.index);
            if (index >= file_.bodies.size()) {
                throw InputError(place, std::to_string(index),
                                 "give an index below " + std::to_string(file_.bodies.size()) + ", or a name");
            }
            return index;
        }
        const auto found = bodyNames_.find(ref.name);
        if (found == bodyNames_.end()) {
            std::vector<std::string> known;
            for (const auto& [name, index] : bodyNames_) {
                known.push_back(name);
            }
            throw InputError(place, quoted(ref.name), "there is no body of that name; " + suggestion(ref.name, known));
        }
        return found->second;
    }

    SceneJoint joint(std::size_t index, const Scene& scene) {
        const std::string place = root_ + "/joints/" + std::to_string(index);
        JointFields& fields = file_.joints[index];
        addName(jointNames_, fields.name, index, place);
        const bool four = std::visit(
            [](const auto& def) {
                return requires {
                    def.d;
                };
            },
            fields.def);
        std::vector<std::size_t> ends = {bodyIndex(fields.a, place + "/a"), bodyIndex(fields.b, place + "/b")};
        if (four) {
            ends.push_back(bodyIndex(fields.c, place + "/c"));
            ends.push_back(bodyIndex(fields.d, place + "/d"));
        }
        for (std::size_t k = 1; k < ends.size(); ++k) {
            for (std::size_t other = 0; other < k; ++other) {
                if (ends[k] == ends[other]) {
                    throw InputError(place + "/" + "abcd"[k], std::string("the same body as ") + "abcd"[other],
                                     "join two different bodies");
                }
            }
        }
        if (std::none_of(ends.begin(), ends.end(),
                         [&](std::size_t i) { return scene.bodies[i].type == BodyType::Dynamic; })) {
            throw InputError(place, "two bodies that are not dynamic",
                             "make one of them dynamic, or leave the joint out");
        }
        std::visit(
            [&](auto& def) {
                def.a = Scene::bodyAt(ends[0]);
                def.b = Scene::bodyAt(ends[1]);
                if constexpr (requires { def.d; }) {
                    def.c = Scene::bodyAt(ends[2]);
                    def.d = Scene::bodyAt(ends[3]);
                }
            },
            fields.def);
        return {fields.name, fields.def};
    }

    static TriangleMesh placed(TriangleMesh made, const Posed& pose) {
        // What is not moved comes back to the last bit.
        if (!pose.position.isZero(0) || !pose.rotation.vec().isZero(0)) {
            for (Vec3d& vertex : made.vertices) {
                vertex = pose * vertex;
            }
        }
        return made;
    }

    static std::string whole(double count) {
        constexpr double largest = 1e18;
        return std::to_string(static_cast<long long>(std::min(count, largest)));
    }

    // Before they are made: a few digits in a file ask for more than any memory holds.
    void countParticles(const std::string& place, const std::string& value, double count) {
        constexpr int most = 1000000;
        particles_ += count;
        if (!(particles_ <= most)) {
            throw InputError(place, value,
                             "that makes " + whole(count) +
                                 " particles, and all ropes, cloth and soft bodies of a scene " + "may have " +
                                 std::to_string(most) + " together: give fewer, larger parts");
        }
    }

    TriangleMesh sheet(const ClothFields& fields, const std::string& place) {
        if (fields.mesh) {
            TriangleMesh given = meshOf(*fields.mesh, place + "/mesh");
            countParticles(place + "/mesh", std::to_string(given.vertices.size()) + " vertices",
                           static_cast<double>(given.vertices.size()));
            return given;
        }
        const GridFields grid = fields.grid.value_or(GridFields{});
        const int u = grid.cells[0];
        const int v = grid.cells[1];
        countParticles(place + "/grid/cells", "[" + std::to_string(u) + "," + std::to_string(v) + "]",
                       (u + 1.0) * (v + 1.0));
        return locate(place, [&] { return clothGrid(grid.corner, grid.u, grid.v, u, v); });
    }

    // Those of the box around it: so many are looked at.
    static double cellsOf(const SoftBodyDef& def) {
        Eigen::AlignedBox3d box;
        for (const Vec3d& vertex : def.surface.vertices) {
            box.extend(vertex);
        }
        return box.isEmpty() ? 0 : (box.sizes() / def.cell).array().round().max(1).prod();
    }

    DeformableDef deformable(std::size_t index) {
        const std::string place = root_ + "/deformables/" + std::to_string(index);
        DeformableFields& fields = file_.deformables[index];
        addName(deformableNames_, fields.name, index, place);
        DeformableDef made;
        if (fields.rope) {
            countParticles(place + "/rope/segments", std::to_string(fields.rope->segments),
                           1.0 + fields.rope->segments);
            made = *fields.rope;
        } else if (fields.cloth) {
            ClothDef& def = fields.cloth->def;
            def.mesh = placed(sheet(*fields.cloth, place + "/cloth"), fields.cloth->pose);
            made = std::move(def);
        } else {
            SoftBodyDef& def = fields.soft->def;
            def.surface = placed(meshOf(fields.soft->surface, place + "/soft/surface"), fields.soft->pose);
            countParticles(place + "/soft/cell", digits(def.cell), cellsOf(def));
            made = std::move(def);
        }
        std::visit(
            [&](auto& def) {
                def.name = fields.name;
                for (std::size_t k = 0; k < fields.attachments.size(); ++k) {
                    Attachment& attachment = def.attachments.emplace_back(fields.attachments[k].def);
                    attachment.body = Scene::bodyAt(
                        bodyIndex(fields.attachments[k].body, place + "/attachments/" + std::to_string(k) + "/body"));
                }
            },
            made);
        return made;
    }

    SceneFile& file_;
    const std::filesystem::path& base_;
    std::string root_;  // of places
    const SceneFiles& files_;
    Names bodyNames_;
    Names jointNames_;
    Names deformableNames_;
    double particles_ = 0;  // so far
};

}  // namespace

Scene parseScene(const std::string& json, const std::filesystem::path& base, const std::string& nameForErrors,
                 const SceneFiles& files) {
    SceneFile file = read(json, nameForErrors);
    Scene scene = SceneMaker(file, base, nameForErrors, files).make();
    scene.name = file.name.empty() ? std::filesystem::path(nameForErrors).stem().string() : file.name;
    return scene;
}

Scene parseScene(const std::string& json, const std::filesystem::path& base, const std::string& nameForErrors) {
    return parseScene(json, base, nameForErrors, {});
}

Scene loadScene(const std::filesystem::path& file, const SceneFiles& files) {
    return parseScene(readInputFile(file), file.parent_path(), file.string(), files);
}

Scene loadScene(const std::filesystem::path& file) {
    return loadScene(file, {});
}

std::string sceneSchema() {
    return schema();
}

}  // namespace cairn
