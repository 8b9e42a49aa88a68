// Scenes between files, structs and worlds: names become ids, materials become shapes' surfaces, files become meshes.
#include <cairn/assets/convex_hull.hpp>
#include <cairn/assets/mesh_file.hpp>

#include "assets/nearest.hpp"
#include "assets/scene_file.hpp"
#include "collision/collision.hpp"

#include <charconv>
#include <fstream>
#include <functional>
#include <sstream>

namespace cairn {

namespace {

using namespace scene_file;
using Names = std::map<std::string, std::size_t>;

std::string quoted(const std::string& text) {
    return "\"" + text + "\"";
}

// Runs `make`; an InputError inside is thrown again with `where` before its field.
template <class Make>
auto locate(const std::string& where, const Make& make) {
    try {
        return make();
    } catch (const InputError& error) {
        const std::string rest = std::string(error.what()).substr(error.field().size() + 3);  // after " = "
        const std::size_t colon = rest.find(": ");
        throw InputError(where + " (" + error.field() + ")", rest.substr(0, colon), rest.substr(colon + 2));
    }
}

std::string readText(const std::filesystem::path& file) {
    if (!std::filesystem::is_regular_file(file)) {
        throw InputError(file.string(), "(no such file)", "check the path");
    }
    std::ifstream in(file, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    if (!in) {
        throw InputError(file.string(), "(unreadable)", "check the file's permissions");
    }
    return text.str();
}

}  // namespace

std::vector<std::vector<double>> loadHeights(const std::filesystem::path& file, double scale) {
    const std::string text = readText(file);
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
    SceneMaker(SceneFile& file, const std::filesystem::path& base, const std::string& nameForErrors)
        : file_(file), base_(base), root_(nameForErrors + ":") {}

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
            return locate(place + "/hull", [&] { return hullOf(*s.hull); });
        }
        if (s.mesh) {
            return locate(place + "/mesh", [&] {
                return mesh(s.mesh->file.empty() ? TriangleMesh{s.mesh->vertices, s.mesh->triangles}
                                                 : loadMesh(base_ / s.mesh->file, s.mesh->scale));
            });
        }
        if (s.heightfield) {
            return heightfield(*s.heightfield, place + "/heightfield");
        }
        return locate(place + "/halfspace", [&] { return halfspace(*s.halfspace); });
    }

    Shape hullOf(const HullFields& s) const {
        if (!s.vertices.empty()) {
            return hull(s.vertices, s.faces);
        }
        return convexHull(s.file.empty() ? s.points : loadMesh(base_ / s.file, s.scale).vertices, s.maxVertices);
    }

    Shape heightfield(const HeightfieldFields& s, const std::string& place) const {
        std::vector<std::vector<double>> heights;
        if (!s.file.empty()) {
            heights = locate(place + "/file", [&] { return loadHeights(base_ / s.file, s.scale); });
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

    TriangleMesh placedMesh(const MeshFields& fields, const Posed& pose) const {
        TriangleMesh made = fields.file.empty() ? TriangleMesh{fields.vertices, fields.triangles}
                                                : loadMesh(base_ / fields.file, fields.scale);
        return placed(std::move(made), pose);
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

    DeformableDef deformable(std::size_t index) {
        const std::string place = root_ + "/deformables/" + std::to_string(index);
        DeformableFields& fields = file_.deformables[index];
        addName(deformableNames_, fields.name, index, place);
        DeformableDef made;
        if (fields.rope) {
            made = *fields.rope;
        } else if (fields.cloth) {
            ClothDef& def = fields.cloth->def;
            const GridFields grid = fields.cloth->grid.value_or(GridFields{});
            def.mesh = locate(place + "/cloth", [&] {
                return fields.cloth->mesh ? placedMesh(*fields.cloth->mesh, fields.cloth->pose)
                                          : placed(clothGrid(grid.corner, grid.u, grid.v, grid.cells[0], grid.cells[1]),
                                                   fields.cloth->pose);
            });
            made = std::move(def);
        } else {
            SoftBodyDef& def = fields.soft->def;
            def.surface = locate(place + "/soft", [&] { return placedMesh(fields.soft->surface, fields.soft->pose); });
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
    std::string root_;
    Names bodyNames_;
    Names jointNames_;
    Names deformableNames_;
};

ShapeFields fieldsOf(const Shape& shape) {
    ShapeFields s;
    const Vec3d& size = shape.size;
    switch (shape.kind) {
        case ShapeKind::Sphere:
            s.sphere = SphereFields{size[0]};
            break;
        case ShapeKind::Capsule:
            s.capsule = StandingFields{size[0], size[1]};
            break;
        case ShapeKind::Box:
            s.box = BoxFields{size};
            break;
        case ShapeKind::Cylinder:
            s.cylinder = StandingFields{size[0], size[1]};
            break;
        case ShapeKind::Cone:
            s.cone = StandingFields{size[0], size[1]};
            break;
        case ShapeKind::Ellipsoid:
            s.ellipsoid = EllipsoidFields{size};
            break;
        case ShapeKind::Hull: {
            s.hull = HullFields{.vertices = shape.hull->vertices};
            for (const Hull::Face& face : shape.hull->faces) {
                s.hull->faces.push_back(face.vertices);
            }
            break;
        }
        case ShapeKind::HalfSpace:
            s.halfspace = HalfSpaceFields{size, shape.offset};
            break;
        case ShapeKind::Mesh:
            s.mesh = MeshFields{.vertices = shape.mesh->triangles().vertices,
                                .triangles = shape.mesh->triangles().triangles};
            for (Vec3d& vertex : s.mesh->vertices) {
                vertex = vertex.cwiseProduct(size).eval();
            }
            break;
        case ShapeKind::HeightField: {
            const HeightField& field = *shape.field;
            s.heightfield = HeightfieldFields{.cellSize = field.cellSize()};
            for (int row = 0; row < field.rows(); ++row) {
                s.heightfield->heights.emplace_back();
                for (int column = 0; column < field.columns(); ++column) {
                    s.heightfield->heights.back().push_back({field.height(column, row)});
                }
            }
            break;
        }
    }
    s.pose = shape.pose;
    const Material& m = shape.material;
    const Material standard;
    const auto unlessStandard = [](double value, double standardValue) {
        return value == standardValue ? std::nullopt : std::optional<double>(value);
    };
    s.friction = unlessStandard(m.friction, standard.friction);
    s.staticFriction = m.staticFriction < 0 ? std::nullopt : std::optional<double>(m.staticFriction);
    s.restitution = unlessStandard(m.restitution, standard.restitution);
    s.density = unlessStandard(m.density, standard.density);
    return s;
}

void requireUniqueNames(const char* what, std::size_t count,
                        const std::function<const std::string&(std::size_t)>& nameOf) {
    Names seen;
    for (std::size_t i = 0; i < count; ++i) {
        const std::string& name = nameOf(i);
        if (!name.empty() && !seen.emplace(name, i).second) {
            throw InputError(what, quoted(name),
                             "numbers " + std::to_string(seen[name]) + " and " + std::to_string(i) +
                                 " share this name; a scene file tells them apart by it");
        }
    }
}

BodyRef refTo(const Scene& scene, BodyId id, const std::string& joint) {
    if (id.index >= scene.bodies.size()) {
        throw InputError("joint " + quoted(joint), "body " + std::to_string(id.index), "join bodies of the scene");
    }
    const std::string& name = scene.bodies[id.index].name;
    return name.empty() ? BodyRef{.index = static_cast<int>(id.index)} : BodyRef{.name = name};
}

}  // namespace

Scene parseScene(const std::string& json, const std::filesystem::path& base, const std::string& nameForErrors) {
    SceneFile file = read(json, nameForErrors);
    Scene scene = SceneMaker(file, base, nameForErrors).make();
    scene.name = file.name.empty() ? std::filesystem::path(nameForErrors).stem().string() : file.name;
    return scene;
}

Scene loadScene(const std::filesystem::path& file) {
    return parseScene(readText(file), file.parent_path(), file.string());
}

std::string toJson(const Scene& scene) {
    if (scene.world.jobs != nullptr) {
        throw InputError("world.jobs", "(a job system)", "leave it null; a file cannot hold one");
    }
    requireUniqueNames("bodies", scene.bodies.size(),
                       [&](std::size_t i) -> const std::string& { return scene.bodies[i].name; });
    requireUniqueNames("joints", scene.joints.size(),
                       [&](std::size_t i) -> const std::string& { return scene.joints[i].name; });
    SceneFile file{.cairn = fileVersion,
                   .name = scene.name,
                   .description = scene.description,
                   .seconds = scene.seconds,
                   .view = scene.view,
                   .world = {scene.world, scene.dt}};
    for (const BodyDef& body : scene.bodies) {
        BodyFields& fields = file.bodies.emplace_back();
        fields.def = body;
        for (const Shape& shape : body.shapes) {
            fields.shapes.push_back(fieldsOf(shape));
        }
    }
    for (const SceneJoint& joint : scene.joints) {
        JointFields& fields = file.joints.emplace_back();
        fields.name = joint.name;
        fields.def = joint.def;
        std::visit(
            [&](const auto& def) {
                fields.a = refTo(scene, def.a, joint.name);
                fields.b = refTo(scene, def.b, joint.name);
                if constexpr (requires { def.d; }) {
                    fields.c = refTo(scene, def.c, joint.name);
                    fields.d = refTo(scene, def.d, joint.name);
                }
            },
            joint.def);
        if (auto* distance = std::get_if<DistanceDef>(&fields.def)) {
            // Any negative length means the distance at time 0, which a file says by leaving the field out.
            distance->lower = distance->lower < 0 ? DistanceDef{}.lower : distance->lower;
            distance->upper = distance->upper < 0 ? DistanceDef{}.upper : distance->upper;
        }
    }
    std::vector<std::string> names;
    for (const DeformableDef& deformable : scene.deformables) {
        DeformableFields& fields = file.deformables.emplace_back();
        std::visit(
            [&]<class Def>(const Def& def) {
                fields.name = names.emplace_back(def.name);
                if constexpr (std::is_same_v<Def, RopeDef>) {
                    fields.rope = def;
                } else if constexpr (std::is_same_v<Def, ClothDef>) {
                    fields.cloth = ClothFields{.def = def};
                    fields.cloth->mesh = MeshFields{.vertices = def.mesh.vertices, .triangles = def.mesh.triangles};
                } else {
                    fields.soft = SoftFields{.def = def};
                    fields.soft->surface =
                        MeshFields{.vertices = def.surface.vertices, .triangles = def.surface.triangles};
                }
                for (const Attachment& attachment : def.attachments) {
                    fields.attachments.push_back({refTo(scene, attachment.body, def.name), attachment});
                }
            },
            deformable);
    }
    requireUniqueNames("deformables", names.size(), [&](std::size_t i) -> const std::string& { return names[i]; });
    return write(file);
}

void saveScene(const Scene& scene, const std::filesystem::path& file) {
    const std::string text = toJson(scene);
    std::ofstream out(file, std::ios::binary);
    out << text;
    out.close();
    if (!out) {
        throw InputError(file.string(), "(not written)", "check that the folder exists and may be written to");
    }
}

std::string sceneSchema() {
    return schema();
}

template <class S>
PopulatedScene<S> populate(World<S>& world, const Scene& scene) {
    PopulatedScene<S> ids;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& def = scene.bodies[i];
        ids.bodies.push_back(locate("body " + (def.name.empty() ? std::to_string(i) : quoted(def.name)),
                                    [&] { return world.add(def); }));
    }
    for (std::size_t i = 0; i < scene.joints.size(); ++i) {
        const std::string where =
            "joint " + (scene.joints[i].name.empty() ? std::to_string(i) : quoted(scene.joints[i].name));
        JointDef def = scene.joints[i].def;
        std::visit(
            [&](auto& joint) {
                std::vector<BodyId*> ends = {&joint.a, &joint.b};
                if constexpr (requires { joint.d; }) {
                    ends.insert(ends.end(), {&joint.c, &joint.d});
                }
                for (BodyId* id : ends) {
                    if (id->index >= ids.bodies.size()) {
                        throw InputError(where, "body " + std::to_string(id->index), "join bodies of the scene");
                    }
                    *id = ids.bodies[id->index];
                }
            },
            def);
        ids.joints.push_back(locate(where, [&] { return world.addJoint(def); }));
    }
    for (std::size_t i = 0; i < scene.deformables.size(); ++i) {
        DeformableDef def = scene.deformables[i];
        const std::string& name = std::visit([](const auto& d) -> const std::string& { return d.name; }, def);
        const std::string where = "deformable " + (name.empty() ? std::to_string(i) : quoted(name));
        std::visit(
            [&](auto& d) {
                for (Attachment& attachment : d.attachments) {
                    if (attachment.body.index >= scene.bodies.size()) {
                        throw InputError(where, "body " + std::to_string(attachment.body.index),
                                         "attach it to bodies of the scene");
                    }
                    attachment.body = ids.bodies[attachment.body.index];
                }
            },
            def);
        ids.deformables.push_back(locate(where, [&] { return cairn::addDeformable(world, def); }));
    }
    return ids;
}

template PopulatedScene<float> populate(World<float>&, const Scene&);
template PopulatedScene<double> populate(World<double>&, const Scene&);

}  // namespace cairn
