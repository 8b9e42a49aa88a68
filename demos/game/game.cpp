#include <cairn/cairn.hpp>
#include <cstdio>
int main() {
    cairn::Worldd world({.gravity = {0, -9.81, 0}});
    cairn::BodyId floor = world.add({.type = cairn::BodyType::Static, .shapes = {cairn::box({50, 1, 50})}, .position = {0, -1, 0}});
    cairn::BodyId crate = world.add({.shapes = {cairn::box({0.5, 0.5, 0.5})}, .position = {0, 4, 0}, .mass = 2});
    for (int i = 0; i < 240; ++i) {
        const cairn::StepReport& report = world.step(1.0 / 60);
        if (!report.ok()) std::printf("%s\n", report.summary().c_str());
    }
    std::printf("The crate lies at %.3f m.\n", world.pose(crate).position.y());
}
