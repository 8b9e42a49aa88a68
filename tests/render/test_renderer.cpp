#include "base/so3.hpp"
#include "tests/render/pictures.hpp"

#include <cstdlib>
#include <functional>
#include <limits>
#include <thread>

#if defined(__SANITIZE_ADDRESS__)
// OSMesa keeps a few hundred bytes for as long as the process lives; leaks of Cairn are still found.
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
    return "leak:libOSMesa";
}
#endif

namespace cairn {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// Looks along -z at the origin from 10 m, on black, lit by the sky alone: what is seen face on has one colour.
DrawScene plainScene() {
    DrawScene scene;
    scene.width = 200;
    scene.height = 150;
    scene.camera = {.eye = {0, 0, 10}, .target = {0, 0, 0}, .verticalFov = 0.4f};
    scene.ground.visible = false;
    scene.background = {{0, 0, 0, 1}, {0, 0, 0, 1}};
    scene.sun.intensity = 0;
    scene.ambientOcclusion = false;
    return scene;
}

TEST(Renderer, redBoxInTheMiddleAndBackgroundElsewhere) {
    DrawScene scene;
    scene.width = 160;
    scene.height = 90;
    scene.ground.visible = false;
    scene.camera = {.eye = {0, 0, 8}, .target = {0, 0, 0}, .verticalFov = 0.6f};
    scene.background = {{0.2f, 0.4f, 0.6f, 1}, {0.2f, 0.4f, 0.6f, 1}};
    scene.instances.push_back({.mesh = unitBox(), .colour = {0.9f, 0.1f, 0.1f, 1}});
    const Image image = renderer().render(scene);
    ASSERT_EQ(image.width, 160);
    ASSERT_EQ(image.height, 90);
    const std::uint8_t* middle = image.pixel(80, 45);
    EXPECT_GT(middle[0], 120);
    EXPECT_LT(middle[1], 80);
    EXPECT_LT(middle[2], 80);
    for (const auto& [x, y] : {std::pair{2, 2}, {157, 2}, {2, 87}, {157, 87}, {80, 5}, {20, 45}}) {
        const std::uint8_t* p = image.pixel(x, y);
        EXPECT_NEAR(p[0], 51, 1);
        EXPECT_NEAR(p[1], 102, 1);
        EXPECT_NEAR(p[2], 153, 1);
        EXPECT_EQ(p[3], 255);
    }
}

TEST(Renderer, firstRowIsTheTop) {
    DrawScene scene = plainScene();
    scene.instances.push_back({.mesh = unitBox(), .pose = {{1, 0.8f, 0}}});
    const Image image = renderer().render(scene);
    const auto pixel = toPixel(scene, {1, 0.8f, 0.5f});
    ASSERT_TRUE(pixel.has_value());
    EXPECT_GT(pixel->x(), 100);
    EXPECT_LT(pixel->y(), 75);
    EXPECT_GT(linearAt(scene, image, {1, 0.8f, 0.5f}).sum(), 0.1f);
    EXPECT_EQ(linearAt(scene, image, {-1, -0.8f, 0.5f}).sum(), 0);
}

// Anti-aliased and encoded as it should be, the linear light of all pixels adds up to the projected area.
TEST(Renderer, coverageIsTheProjectedArea) {
    for (const float turn : {0.f, 0.2f, 0.6f}) {
        DrawScene scene = plainScene();
        scene.instances.push_back({.mesh = unitBox(), .pose = {{0.013f, -0.021f, 0}, expQuat<float>({0, 0, turn})}});
        const Image image = renderer().render(scene);
        double sum = 0;
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x) {
                sum += static_cast<double>(linearAt(image, x, y).y());
            }
        }
        const double side = 150 / (2 * std::tan(0.2) * 9.5);  // pixels, of the face 9.5 m away
        const double face = static_cast<double>(linearAt(scene, image, {0, 0, 0.5f}).y());
        EXPECT_NEAR(sum / face / (side * side), 1, 0.01) << "turned by " << turn;
    }
}

TEST(Renderer, lightIsLinear) {
    const auto shade = [](float albedo) {
        DrawScene scene = plainScene();
        const float encoded = linearToSrgb(albedo);
        scene.instances.push_back({.mesh = unitBox(), .colour = {encoded, encoded, encoded, 1}});
        return linearAt(scene, renderer().render(scene), {0, 0, 0.5f}).y();
    };
    EXPECT_NEAR(shade(0.8f) / shade(0.4f), 2, 0.03);
    EXPECT_NEAR(shade(0.4f) / shade(0.2f), 2, 0.04);
}

// Lambert: with the sun along the view, a face turned by an angle gets cos(angle) of the sun's light.
TEST(Renderer, sunFollowsTheCosine) {
    const auto sunOn = [](float angle) {
        DrawScene scene = plainScene();
        scene.sun = {.direction = {0, 0, -1}, .intensity = 0, .shadows = false};
        scene.instances.push_back(
            {.mesh = unitBox(), .pose = {{0, 0, 0}, expQuat<float>({angle, 0, 0})}, .colour = {0.4f, 0.4f, 0.4f, 1}});
        const Vec3f centre = scene.instances[0].pose * Vec3f(0, 0, 0.5f);
        const float without = linearAt(scene, renderer().render(scene), centre).y();
        scene.sun.intensity = 1;
        return linearAt(scene, renderer().render(scene), centre).y() - without;
    };
    // At 40 degrees and more the faint highlight (36th power) is under 1 %.
    EXPECT_NEAR(sunOn(1.0f) / sunOn(0.7f), std::cos(1.0f) / std::cos(0.7f), 0.02);
}

TEST(Renderer, nearBodyHidesFarBodyInAnyOrder) {
    for (const bool nearFirst : {true, false}) {
        for (const float side : {1.f, -1.f}) {
            DrawScene scene = plainScene();
            scene.camera.eye = {0, 0, 10 * side};
            const DrawInstance red = {.mesh = unitBox(), .pose = {{0, 0, 2}}, .colour = {0.9f, 0.1f, 0.1f, 1}};
            const DrawInstance blue = {.mesh = unitBall(), .pose = {{0, 0, -2}}, .colour = {0.1f, 0.1f, 0.9f, 1}};
            scene.instances = nearFirst ? std::vector{red, blue} : std::vector{blue, red};
            const Vec3f seen = linearAt(renderer().render(scene), 100, 75);
            if (side > 0) {
                EXPECT_GT(seen.x(), 5 * seen.z());
            } else {
                EXPECT_GT(seen.z(), 5 * seen.x());
            }
        }
    }
}

// True if the segment from p along d meets the box of half size h about c within [from, to].
bool meets(const Vec3f& p, const Vec3f& d, const Vec3f& c, const Vec3f& h, float from, float to) {
    for (int i = 0; i < 3; ++i) {
        const float a = (c[i] - h[i] - p[i]) / d[i];
        const float b = (c[i] + h[i] - p[i]) / d[i];
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
    }
    return from < to;
}

TEST(Renderer, shadowFallsWhereTheSunIsHidden) {
    DrawScene scene;
    scene.width = 480;
    scene.height = 270;
    scene.ambientOcclusion = false;
    scene.camera = {.eye = {1, 9, 7}, .target = {0.5f, 0.5f, 0}, .verticalFov = 0.8f};
    scene.sun.direction = {0.5f, -1.0f, 0.13f};
    const Vec3f centre(-0.4f, 1.5f, 0.2f);
    const Vec3f half(0.6f, 0.3f, 0.5f);
    scene.instances.push_back({.mesh = unitBox(), .pose = {centre}, .scale = 2 * half});
    const Image with = renderer().render(scene);
    scene.sun.shadows = false;
    const Image without = renderer().render(scene);

    const Vec3f toSun = -scene.sun.direction;
    const Vec3f margin = Vec3f::Constant(0.06f);  // half the soft rim and a pixel
    int dark = 0;
    int bright = 0;
    for (float x = -2.5f; x <= 3.5f; x += 0.07f) {
        for (float z = -2; z <= 2; z += 0.07f) {
            const Vec3f p(x, 0, z);
            if (meets(p, scene.camera.eye - p, centre, half + margin, 0, 1)) {
                continue;  // hidden by the box
            }
            const float ratio = linearAt(scene, with, p).y() / linearAt(scene, without, p).y();
            if (meets(p, toSun, centre, half - margin, 0, 10)) {
                EXPECT_LT(ratio, 0.62f) << p.transpose();
                ++dark;
            } else if (!meets(p, toSun, centre, half + margin, 0, 10)) {
                EXPECT_GT(ratio, 0.99f) << p.transpose();
                ++bright;
            }
        }
    }
    EXPECT_GT(dark, 100);
    EXPECT_GT(bright, 1000);

    // On a body that nothing shades there is no shadow: its lit faces look the same with and without (no acne).
    for (float x = -0.5f; x <= 0.5f; x += 0.05f) {
        const Vec3f top = centre + Vec3f(x, half.y(), 0.8f * x);
        EXPECT_NEAR(linearAt(scene, with, top).y() / linearAt(scene, without, top).y(), 1, 0.01);
    }
}

TEST(Renderer, shadowFallsOnBodies) {
    DrawScene scene = plainScene();
    scene.sun = {.direction = {0, 0, -1}};
    scene.camera.eye = {8, 8, 10};
    scene.instances.push_back({.mesh = unitBox(), .pose = {{0, 0, -2}}, .scale = {3, 3, 1}});
    scene.instances.push_back({.mesh = unitBall(), .pose = {{0, 0, 0}}});
    const Image image = renderer().render(scene);
    // The wall's front is at z = -1.5; the ball shades its middle, and from this side the ball hides none of it.
    const float shaded = linearAt(scene, image, {-0.3f, -0.3f, -1.5f}).y();
    const float open = linearAt(scene, image, {-1.2f, -1.2f, -1.5f}).y();
    EXPECT_LT(shaded, 0.6f * open);
    scene.instances.back().castsShadow = false;
    EXPECT_GT(linearAt(scene, renderer().render(scene), {-0.3f, -0.3f, -1.5f}).y(), 0.97f * open);
}

// The light's box is fitted to the small bodies, and to a slab twenty times as large beside them.
TEST(Renderer, shadowOfALargeBodyIsWhole) {
    DrawScene scene;
    scene.width = 480;
    scene.height = 270;
    scene.ambientOcclusion = false;
    scene.camera = {.eye = {0, 12, 6}, .target = {0, 0, 0}, .verticalFov = 0.7f};
    scene.sun.direction = {0, -1, 0.5f};
    for (int i = 0; i < 3; ++i) {
        scene.instances.push_back(
            {.mesh = unitBox(), .pose = {{0.4f * static_cast<float>(i), 0.1f, 2}}, .scale = {0.2f, 0.2f, 0.2f}});
    }
    scene.instances.push_back({.mesh = unitBox(), .pose = {{0, 2, 0}}, .scale = {7, 0.2f, 1}});
    const Image image = renderer().render(scene);
    const float open = linearAt(scene, image, {-3.3f, 0, 2.2f}).y();
    for (const float x : {-3.3f, -2.0f, 2.0f, 3.3f}) {
        EXPECT_LT(linearAt(scene, image, {x, 0, 1}).y(), 0.62f * open) << x;
    }
}

TEST(Renderer, curvedMeshesLookSmoothAndBoxesFlat) {
    DrawScene scene = plainScene();
    scene.sun.intensity = 1;
    scene.sun.shadows = false;
    scene.camera.verticalFov = 0.15f;
    const MeshHandle coarse = renderer().addMesh(drawSphere(0.5, 24));
    const MeshHandle fine = renderer().addMesh(drawSphere(0.5, 192));
    const auto draw = [&](MeshHandle mesh) {
        scene.instances = {{.mesh = mesh, .pose = {{0, 0, 0}, expQuat<float>({0.4f, 0.3f, 0})}}};
        return renderer().render(scene);
    };
    const Image a = draw(coarse);
    const Image b = draw(fine);
    int worst = 0;
    for (int y = 55; y < 95; ++y) {
        for (int x = 80; x < 120; ++x) {
            worst = std::max(worst, std::abs(a.pixel(x, y)[1] - b.pixel(x, y)[1]));
        }
    }
    EXPECT_LE(worst, 6);
    // Facets of 15 degrees would step by far more; a box seen at the same angle has one colour a face.
    scene.sun.intensity = 0;
    const Image box = draw(unitBox());
    EXPECT_NEAR(box.pixel(97, 78)[1], box.pixel(105, 70)[1], 1);
    renderer().removeMesh(coarse);
    renderer().removeMesh(fine);
}

TEST(Renderer, repeatedVerticesDoNotBreakSmoothness) {
    const TriangleMesh ball = drawSphere(0.5);
    TriangleMesh soup;
    for (const auto& triangle : ball.triangles) {
        for (const int index : triangle) {
            soup.vertices.push_back(ball.vertices[static_cast<std::size_t>(index)]);
        }
        const int n = static_cast<int>(soup.vertices.size());
        soup.triangles.push_back({n - 3, n - 2, n - 1});
    }
    const MeshHandle mesh = renderer().addMesh(soup);
    DrawScene scene = plainScene();
    scene.sun.intensity = 1;
    scene.instances = {{.mesh = unitBall()}};
    const Image expected = renderer().render(scene);
    scene.instances = {{.mesh = mesh}};
    EXPECT_TRUE(compareImages(expected, renderer().render(scene)).same);
    renderer().removeMesh(mesh);
}

TEST(Renderer, scaleStandsForSize) {
    const MeshHandle slab = renderer().addMesh(drawBox({1, 0.25, 0.6}));
    DrawScene scene = testScene(unitBox(), unitBall());
    const Posef pose{{1, 2.5f, 1}, expQuat<float>({0.3f, 0.2f, 0.5f})};
    scene.instances.push_back({.mesh = slab, .pose = pose});
    const Image expected = renderer().render(scene);
    scene.instances.back() = {.mesh = unitBox(), .pose = pose, .scale = {2, 0.5f, 1.2f}};
    EXPECT_LT(compareImages(expected, renderer().render(scene)).meanAbs, 1e-4);
    renderer().removeMesh(slab);
}

TEST(Renderer, sameSceneSameBytes) {
    DrawScene scene = testScene(unitBox(), unitBall());
    addContact(scene, {0, 0.5f, 0.8f}, {0, 0, 1}, 0.5f);
    scene.instances[3].colour.a = 0.4f;
    const Image first = renderer().render(scene);
    DrawScene other = scene;
    other.instances.resize(3);
    other.width = 100;
    renderer().render(other);
    EXPECT_EQ(first, renderer().render(scene));

    // Another renderer, on another thread, beside this one.
    Image second;
    std::thread worker([&] {
        Renderer fresh;
        DrawScene copy = scene;
        const MeshHandle box = fresh.addMesh(drawBox({0.5, 0.5, 0.5}));
        const MeshHandle ball = fresh.addMesh(drawSphere(0.5));
        for (DrawInstance& instance : copy.instances) {
            instance.mesh = instance.mesh == unitBox() ? box : ball;
        }
        second = fresh.render(copy);
    });
    const Image third = renderer().render(scene);
    worker.join();
    EXPECT_EQ(first, second);
    EXPECT_EQ(first, third);

    // The same renderer, from another thread.
    Image fourth;
    std::thread([&] { fourth = renderer().render(scene); }).join();
    EXPECT_EQ(first, fourth);
}

// Not a test by itself: draws for the next one, in a process of its own.
TEST(RendererChild, draws) {
    const char* file = std::getenv("CAIRN_TEST_PICTURE");
    if (file == nullptr) {
        GTEST_SKIP() << "runs as a child of Renderer.threadCountOfTheRasteriserDoesNotMatter";
    }
    writePng(renderer().render(testScene(unitBox(), unitBall())), file);
}

TEST(Renderer, threadCountOfTheRasteriserDoesNotMatter) {
    const Image here = renderer().render(testScene(unitBox(), unitBall()));
    const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
    for (const char* threads : {"0", "1", "2"}) {
        const std::string file = scratch(std::string("threads") + threads + ".png").string();
        const std::string command = std::string("LP_NUM_THREADS=") + threads + " CAIRN_TEST_PICTURE='" + file + "' '" +
                                    self + "' --gtest_filter=RendererChild.draws > /dev/null";
        ASSERT_EQ(std::system(command.c_str()), 0);
        const ImageDifference difference = compareImages(here, readPng(file));
        EXPECT_TRUE(difference.same) << difference.summary();
    }
}

TEST(Renderer, farFromTheOriginLooksTheSame) {
    DrawScene scene = testScene(unitBox(), unitBall());
    const Image expected = renderer().render(scene);
    const Vec3f shift(8192, 0, -4096);  // even: the checks of the ground repeat every two metres
    for (DrawInstance& instance : scene.instances) {
        instance.pose.position += shift;
    }
    scene.camera.eye += shift;
    scene.camera.target += shift;
    const ImageDifference difference = compareImages(expected, renderer().render(scene));
    EXPECT_TRUE(difference.same) << difference.summary();
}

TEST(Renderer, overlaysShowThroughBodies) {
    DrawScene scene = plainScene();
    scene.instances.push_back(
        {.mesh = unitBox(), .pose = {{0, 0, 0}}, .colour = {0.5f, 0.5f, 0.5f, 1}, .scale = {4, 2, 1}});
    const Colour red = {1, 0, 0, 1};
    const Image plain = renderer().render(scene);
    const auto redness = [&](const DrawScene& drawn, const Vec3f& p) {
        const Image image = renderer().render(drawn);
        return linearAt(drawn, image, p).x() - linearAt(drawn, plain, p).x();
    };
    const auto line = [&](float z, bool through) {
        DrawScene drawn = scene;
        drawn.lines.push_back({{-1, 0.3f, z}, {1, 0.3f, z}, red, 5, through});
        return redness(drawn, {0.11f, 0.3f, z});
    };
    const auto point = [&](float z, bool through) {
        DrawScene drawn = scene;
        drawn.points.push_back({{0.2f, -0.3f, z}, red, 9, through});
        return redness(drawn, {0.2f, -0.3f, z});
    };
    const float before = linearAt(plain, 100, 75).x();
    for (const auto& draw : {std::function<float(float, bool)>(line), std::function<float(float, bool)>(point)}) {
        EXPECT_NEAR(draw(2, true), 1 - before, 0.02);  // in front: the full colour
        EXPECT_NEAR(draw(2, false), 1 - before, 0.02);
        EXPECT_NEAR(draw(0.5f, false), 1 - before, 0.02);        // on the surface: still in front of it
        EXPECT_NEAR(draw(-2, true), 0.4f * (1 - before), 0.02);  // behind: 40 %
        EXPECT_NEAR(draw(-2, false), 0, 0.001);                  // behind and not through: hidden
    }
}

TEST(Renderer, lineIsAsWideAsAsked) {
    for (const float width : {1.f, 2.f, 6.f}) {
        DrawScene scene = plainScene();
        scene.lines.push_back({{-1, 0.013f, 0}, {1, 0.013f, 0}, {1, 1, 1, 1}, width});
        const Image image = renderer().render(scene);
        float sum = 0;
        for (int y = 0; y < image.height; ++y) {
            sum += linearAt(image, 100, y).y();
        }
        EXPECT_NEAR(sum, width, 0.1f);
    }
}

TEST(Renderer, linesFromBehindTheCameraAreCut) {
    DrawScene scene = plainScene();
    scene.lines.push_back({{0.5f, 0, -5}, {0.5f, 0, 30}, {1, 1, 1, 1}, 3});
    const Image image = renderer().render(scene);
    EXPECT_GT(linearAt(scene, image, {0.5f, 0, 4}).y(), 0.9f);
    EXPECT_LT(linearAt(image, 20, 75).y(), 0.01f);
}

TEST(Renderer, overlayHelpersMarkWhatTheySay) {
    DrawScene scene = plainScene();
    addFrame(scene, {{0, 0, 0}}, 1);
    addContact(scene, {-1, 0, 0}, {0, 1, 0}, 0.7f, {1, 1, 0, 1});
    addBoxOutline(scene, {{0, 0, 0}}, {1.7f, 1.2f, 0.1f}, {0, 1, 1, 1}, 3);
    const Image image = renderer().render(scene);
    const Vec3f x = linearAt(scene, image, {0.6f, 0, 0});
    EXPECT_GT(x.x(), 5 * x.y());
    const Vec3f y = linearAt(scene, image, {0, 0.6f, 0});
    EXPECT_GT(y.y(), 3 * y.x());
    EXPECT_GT(linearAt(scene, image, {-1, 0, 0}).x(), 0.8f);
    EXPECT_GT(linearAt(scene, image, {-1, 0.4f, 0}).y(), 0.4f);
    EXPECT_GT(linearAt(scene, image, {0.5f, 1.2f, 0.1f}).z(), 0.7f);
    EXPECT_EQ(scene.lines.size(), 3u * 4u + 4u + 12u);
}

TEST(Renderer, seeThroughBodiesBlendInAnyOrderAndCastNoShadow) {
    const DrawInstance wall = {
        .mesh = unitBox(), .pose = {{0, 0, -2}}, .colour = {0.9f, 0.1f, 0.1f, 1}, .scale = {4, 4, 1}};
    const DrawInstance glass = {.mesh = unitBox(), .pose = {{0, 0, 0}}, .colour = {0.1f, 0.9f, 0.1f, 0.5f}};
    const DrawInstance farGlass = {.mesh = unitBall(), .pose = {{0, 0, -1}}, .colour = {0.1f, 0.1f, 0.9f, 0.5f}};
    DrawScene scene = plainScene();
    const auto middle = [&](std::vector<DrawInstance> instances) {
        scene.instances = std::move(instances);
        return linearAt(renderer().render(scene), 100, 75);
    };
    const Vec3f bare = middle({wall});
    DrawInstance solid = glass;
    solid.colour.a = 1;
    const Vec3f green = middle({solid});
    const Vec3f blended = middle({wall, glass});
    EXPECT_LT((blended - 0.5f * (bare + green)).cwiseAbs().maxCoeff(), 0.01f);
    EXPECT_EQ(middle({wall, farGlass, glass}), middle({glass, farGlass, wall}));

    scene.sun = {.direction = {0, 0, -1}};
    scene.camera.eye = {4, 3, 10};
    scene.instances = {wall, glass};
    const Vec3f spot(-0.2f, -0.2f, -1.5f);
    const Vec3f under = linearAt(scene, renderer().render(scene), spot);
    scene.sun.shadows = false;
    EXPECT_EQ(under, linearAt(scene, renderer().render(scene), spot));
}

TEST(Renderer, occlusionDarkensContactsOnly) {
    DrawScene scene;
    scene.width = 480;
    scene.height = 270;
    scene.camera = {.eye = {0, 2.5f, 5}, .target = {0, 0.5f, 0}, .verticalFov = 0.7f};
    scene.sun.shadows = false;
    scene.instances.push_back({.mesh = unitBox(), .pose = {{0, 0.5f, 0}}});
    const Image with = renderer().render(scene);
    scene.ambientOcclusion = false;
    const Image without = renderer().render(scene);
    const auto ratio = [&](const Vec3f& p) { return linearAt(scene, with, p).y() / linearAt(scene, without, p).y(); };
    EXPECT_LT(ratio({0, 0, 0.53f}), 0.93f);
    EXPECT_GT(ratio({0, 0, 1.3f}), 0.99f);
    EXPECT_GT(ratio({0, 1, 0}), 0.99f);
    EXPECT_GT(ratio({-2.5f, 0, -20}), 0.99f);
}

TEST(Renderer, cameraThatSeesShowsAllCornersAndLittleElse) {
    const Vec3f low(-3, 0, -1);
    const Vec3f high(5, 2, 4);
    for (const Vec3f& from : {Vec3f(0.5f, 0.35f, 1), Vec3f(-1, 0.2f, 0), Vec3f(0, 1, 0), Vec3f(0.3f, -0.5f, -1)}) {
        DrawScene scene;
        scene.camera = cameraThatSees(low, high, from, 1280.f / 720);
        Eigen::Array2f nearestRim = Eigen::Array2f::Constant(1);
        for (int bits = 0; bits < 8; ++bits) {
            const Vec3f corner((bits & 1) != 0 ? high.x() : low.x(), (bits & 2) != 0 ? high.y() : low.y(),
                               (bits & 4) != 0 ? high.z() : low.z());
            const auto pixel = toPixel(scene, corner);
            ASSERT_TRUE(pixel.has_value());
            const Eigen::Array2f share = pixel->array() / Eigen::Array2f(1280, 720);
            nearestRim = nearestRim.min(share).min(1 - share);
        }
        EXPECT_GT(nearestRim.minCoeff(), 0.02f);
        EXPECT_LT(nearestRim.minCoeff(), 0.15f);
    }
}

TEST(Renderer, emptySceneIsABackdrop) {
    DrawScene scene;
    scene.width = 33;
    scene.height = 17;
    const Image image = renderer().render(scene);
    EXPECT_EQ(image.rgba.size(), 4u * 33 * 17);
    scene.width = 1;
    scene.height = 1;
    EXPECT_EQ(renderer().render(scene).rgba.size(), 4u);
}

TEST(Renderer, badScenesAreRefusedByName) {
    const auto refused = [](auto&& change) {
        DrawScene scene = plainScene();
        scene.instances.push_back({.mesh = unitBox()});
        scene.lines.push_back({});
        scene.points.push_back({});
        change(scene);
        return complaint([&] { renderer().render(scene); });
    };
    EXPECT_EQ(refused([](DrawScene&) {}), "");
    EXPECT_EQ(refused([](DrawScene& s) { s.width = 0; }), "picture size");
    EXPECT_EQ(refused([](DrawScene& s) { s.height = -4; }), "picture size");
    EXPECT_EQ(refused([](DrawScene& s) { s.width = 100000; }), "picture size");
    EXPECT_EQ(refused([](DrawScene& s) { s.instances[0].pose.position.y() = nan; }), "instances[0].pose.position");
    EXPECT_EQ(refused([](DrawScene& s) { s.instances[0].pose.rotation.w() = nan; }), "instances[0].pose.rotation");
    EXPECT_EQ(refused([](DrawScene& s) { s.instances[0].pose.rotation.w() = 2; }), "instances[0].pose.rotation");
    EXPECT_EQ(refused([](DrawScene& s) { s.instances[0].scale.x() = 0; }), "instances[0].scale");
    EXPECT_EQ(refused([](DrawScene& s) { s.instances[0].colour.g = 1.5f; }), "instances[0].colour");
    EXPECT_EQ(refused([](DrawScene& s) { s.instances[0].mesh = {}; }), "instances[0].mesh");
    EXPECT_EQ(refused([](DrawScene& s) { s.lines[0].to.x() = nan; }), "lines[0].to");
    EXPECT_EQ(refused([](DrawScene& s) { s.lines[0].width = 0; }), "lines[0].width");
    EXPECT_EQ(refused([](DrawScene& s) { s.points[0].position.x() = nan; }), "points[0].position");
    EXPECT_EQ(refused([](DrawScene& s) { s.camera.eye = s.camera.target; }), "camera");
    EXPECT_EQ(refused([](DrawScene& s) { s.camera.up = {0, 0, 1}; }), "camera");
    EXPECT_EQ(refused([](DrawScene& s) { s.camera.verticalFov = 4; }), "camera.verticalFov");
    EXPECT_EQ(refused([](DrawScene& s) { s.sun.direction = {0, 0, 0}; }), "sun.direction");
    EXPECT_EQ(refused([](DrawScene& s) { s.sun.intensity = nan; }), "sun.intensity");
    EXPECT_EQ(refused([](DrawScene& s) { s.ground.cell = 0; }), "ground");
    EXPECT_EQ(refused([](DrawScene& s) { s.background.top.r = nan; }), "background.top");
}

TEST(Renderer, badMeshesAreRefusedByName) {
    const auto refused = [](const TriangleMesh& mesh) { return complaint([&] { renderer().addMesh(mesh); }); };
    EXPECT_EQ(refused({}), "mesh");
    TriangleMesh mesh = drawBox({1, 1, 1});
    mesh.triangles[5][1] = 8;
    EXPECT_EQ(refused(mesh), "mesh.triangles[5].index");
    mesh = drawBox({1, 1, 1});
    mesh.vertices[3].y() = std::numeric_limits<double>::infinity();
    EXPECT_EQ(refused(mesh), "mesh.vertices[3].position");
}

TEST(Renderer, staleMeshesAreCaught) {
    const MeshHandle mesh = renderer().addMesh(drawBox({1, 1, 1}));
    renderer().removeMesh(mesh);
    const MeshHandle heir = renderer().addMesh(drawBox({1, 1, 1}));
    EXPECT_EQ(heir.index, mesh.index);
    DrawScene scene = plainScene();
    scene.instances.push_back({.mesh = mesh});
    EXPECT_EQ(complaint([&] { renderer().render(scene); }), "instances[0].mesh");
    EXPECT_EQ(complaint([&] { renderer().removeMesh(mesh); }), "mesh");
    renderer().removeMesh(heir);
}

}  // namespace
}  // namespace cairn
