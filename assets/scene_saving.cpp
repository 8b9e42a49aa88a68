// Scenes to files: ids become names, or numbers where there is no name; meshes are written out.
#include "assets/located_error.hpp"
#include "assets/scene_file.hpp"
#include "base/output_file.hpp"
#include "collision/collision.hpp"

#include <functional>

namespace cairn {

namespace {

using namespace scene_file;

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
    s.rollingFriction = unlessStandard(m.rollingFriction, standard.rollingFriction);
    s.spinningFriction = unlessStandard(m.spinningFriction, standard.spinningFriction);
    s.density = unlessStandard(m.density, standard.density);
    return s;
}

void requireUniqueNames(const char* what, std::size_t count,
                        const std::function<const std::string&(std::size_t)>& nameOf) {
    std::map<std::string, std::size_t> seen;
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
                    fields.cloth.emplace().def = def;
                    fields.cloth->mesh = MeshFields{.vertices = def.mesh.vertices, .triangles = def.mesh.triangles};
                } else {
                    fields.soft.emplace().def = def;
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
    writeFile("scene file", file, toJson(scene));
}

}  // namespace cairn
