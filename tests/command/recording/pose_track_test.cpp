// Poses in few bytes: exact up to the stated rounding, and the same bytes for ever.
#include "command/recording/recording.hpp"
#include "demos/demos.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace cairn {
namespace {

std::string hex(const std::string& bytes) {
    std::string out;
    for (const char c : bytes) {
        constexpr const char* digits = "0123456789abcdef";
        out += digits[static_cast<unsigned char>(c) >> 4];
        out += digits[static_cast<unsigned char>(c) & 15];
    }
    return out;
}

TEST(Base64, IsAsRfc4648Says) {
    const std::vector<std::pair<std::string, std::string>> vectors = {{"", ""},
                                                                      {"f", "Zg=="},
                                                                      {"fo", "Zm8="},
                                                                      {"foo", "Zm9v"},
                                                                      {"foob", "Zm9vYg=="},
                                                                      {"fooba", "Zm9vYmE="},
                                                                      {"foobar", "Zm9vYmFy"},
                                                                      {std::string("\xff\x00\xfe", 3), "/wD+"}};
    for (const auto& [bytes, text] : vectors) {
        EXPECT_EQ(toBase64(bytes), text);
        EXPECT_EQ(fromBase64(text), bytes);
    }
    for (const char* const bad : {"Zg=", "Zg", "Z===", "Zm9v!m9v", "=m9v"}) {
        EXPECT_FALSE(fromBase64(bad)) << bad;
    }
}

// By hand: at the origin, unturned, every number is 0 but w = 65536. First frame: six zeros (00 05), then 65536, zigzag
// 131072 = 80 80 08. Second: six zeros, then 65536 - 2 * 65536 = -65536, zigzag 131071 = ff ff 07. Then 65536 - 2 *
// 65536
// + 65536 = 0: from there on zeros. In the last of five frames x is 1 mm, 65.536 units, rounded to 66, zigzag 132 = 84
// 01; before it stand the 14 zeros of two frames (00 0d), after it six (00 05).
TEST(PoseTrack, BytesAreThose) {
    PoseTrackWriter writer;
    Posed pose;
    pose.position.setZero();
    pose.rotation.setIdentity();
    for (int i = 0; i < 4; ++i) {
        writer.add(pose);
    }
    pose.position.x() = 0.001;
    writer.add(pose);
    EXPECT_EQ(hex(writer.finish()),
              "0005808008"
              "0005ffff07"
              "000d"
              "8401"
              "0005");
}

TEST(PoseTrack, ReadsWhatWasWrittenToTheStatedRounding) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const auto vector = [&](double size) {
        return Vec3d(size * Vec3d(normal(random), normal(random), normal(random)));
    };
    std::vector<Posed> poses;
    Posed pose;
    pose.position = Vec3d(120, -3, 1e4);
    pose.rotation.setIdentity();
    Vec3d velocity = vector(0.1);
    Vec3d spin = vector(0.2);
    for (int i = 0; i < 400; ++i) {
        if (i % 90 < 60) {  // and rests in between
            velocity += vector(0.01);
            spin += vector(0.05);
            pose.position += velocity;
            pose.rotation = Quatd(Eigen::AngleAxisd(spin.norm(), spin.normalized())) * pose.rotation;
        }
        if (i % 7 == 0) {
            pose.rotation.coeffs() *= -1;  // the same rotation
        }
        poses.push_back(pose);
    }
    poses.back().position = Vec3d(-1e9, 1e9, 0);
    PoseTrackWriter writer;
    for (const Posed& one : poses) {
        writer.add(one);
    }
    const std::string bytes = writer.finish();
    PoseTrackReader reader(bytes);
    for (const Posed& one : poses) {
        EXPECT_FALSE(reader.done());
        const std::optional<PoseValues> values = reader.next();
        ASSERT_TRUE(values);
        const Posed read = poseOf(*values);
        EXPECT_LE((read.position - one.position).norm(), positionRounding + 1e-6 * (one.position.norm() > 1e8));
        EXPECT_LE(read.rotation.angularDistance(one.rotation), 0.004 * std::numbers::pi / 180);
    }
    EXPECT_TRUE(reader.done());
    EXPECT_FALSE(reader.next());
    for (const std::size_t cut : {bytes.size() - 1, bytes.size() / 2, std::size_t{1}}) {
        const std::string torn = bytes.substr(0, cut);
        PoseTrackReader tornReader(torn);
        int read = 0;
        while (tornReader.next()) {
            ++read;
        }
        EXPECT_LT(read, 400) << cut;
    }
}

TEST(PoseTrack, RestCostsNothingAndFallsTwoBytesANumber) {
    PoseTrackWriter rest, fall;
    Posed pose;
    pose.rotation = Quatd(Eigen::AngleAxisd(1, Vec3d(1, 2, 3).normalized()));
    for (int i = 0; i < 600; ++i) {
        pose.position = Vec3d(1, 2, 3);
        rest.add(pose);
        pose.position.y() = 100 - 0.5 * 9.81 * i * i / 3600.0;
        fall.add(pose);
    }
    EXPECT_LE(rest.finish().size(), 50u);
    EXPECT_LE(fall.finish().size(), 50u + 600 * 4);  // the acceleration, and the zeros between
}

}  // namespace
}  // namespace cairn
