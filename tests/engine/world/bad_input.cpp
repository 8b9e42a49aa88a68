#include "tests/engine/world/bad_input.hpp"

namespace cairn {

void expectRefused(const std::string& field, FunctionRef<void()> act) {
    try {
        act();
        ADD_FAILURE() << "accepted: " << field;
    } catch (const InputError& error) {
        EXPECT_NE(error.field().find(field), std::string::npos) << error.what();
        EXPECT_GT(std::string(error.what()).size(), error.field().size() + 8) << "value and remedy: " << error.what();
    }
}

BodyDef goodBody() {
    return {.name = "crate", .shapes = {unitBox()}, .mass = 1};
}

void expectBodyRefused(const std::string& field, FunctionRef<void(BodyDef&)> change) {
    Worldd world;
    BodyDef def = goodBody();
    change(def);
    expectRefused(field, [&] { world.add(def); });
    EXPECT_TRUE(world.bodies().empty()) << field;
    EXPECT_NO_THROW(world.step(1.0 / 60));
}

}  // namespace cairn
