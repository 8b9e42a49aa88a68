// Scenes into worlds: numbers of bodies become ids.
#include <cairn/assets/scene.hpp>

#include "assets/located_error.hpp"

namespace cairn {

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
