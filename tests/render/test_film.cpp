#include "tests/render/pictures.hpp"
#include "tests/small_disk.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <random>

namespace cairn {
namespace {

// Colours far from each other, with a body so that there is something to move.
std::vector<Image> frames(int count) {
    std::vector<Image> out;
    for (int i = 0; i < count; ++i) {
        Image image(65, 41, {0.2f, 0.4f, 0.7f, 1});  // odd sides: H.264 players want even ones
        for (int y = 10; y < 30; ++y) {
            for (int x = 5 + 4 * i; x < 25 + 4 * i; ++x) {
                std::uint8_t* p = image.pixel(x, y);
                p[0] = 220;
                p[1] = 120;
                p[2] = 40;
            }
        }
        out.push_back(image);
    }
    return out;
}

// Hides all programs while it lives.
class NoPath {
public:
    NoPath() : before_(std::getenv("PATH")) { setenv("PATH", "/nonexistent", 1); }
    ~NoPath() { setenv("PATH", before_.c_str(), 1); }
    NoPath(const NoPath&) = delete;
    NoPath& operator=(const NoPath&) = delete;

private:
    std::string before_;
};

TEST(Film, picturesComeBack) {
    if (!filmAvailable()) {
        GTEST_SKIP() << "ffmpeg is not on PATH";
    }
    const std::vector<Image> pictures = frames(6);
    for (const char* ending : {".mp4", ".gif"}) {
        const auto file = scratch(std::string("film") + ending);
        FilmWriter film(file, 25);
        for (const Image& picture : pictures) {
            film.add(picture);
        }
        EXPECT_EQ(film.count(), 6);
        film.finish();
        film.finish();
        const std::string command = "ffmpeg -hide_banner -loglevel error -y -i '" + file.string() + "' '" +
                                    scratch("back_%d.png").string() + "'";
        ASSERT_EQ(std::system(command.c_str()), 0);
        for (int i = 0; i < 6; ++i) {
            const Image back = readPng(scratch("back_" + std::to_string(i + 1) + ".png"));
            ASSERT_GE(back.width, 65);
            ASSERT_GE(back.height, 41);
            for (const auto& [x, y] : {std::pair{2, 2}, {15 + 4 * i, 20}, {60, 38}}) {
                for (int part = 0; part < 3; ++part) {
                    EXPECT_NEAR(back.pixel(x, y)[part], pictures[static_cast<std::size_t>(i)].pixel(x, y)[part], 12)
                        << ending << " picture " << i << " at " << x << ", " << y;
                }
            }
        }
        EXPECT_FALSE(std::filesystem::exists(scratch("back_7.png")));
    }
}

TEST(Film, withoutFfmpegSaysSoAndWritesPictures) {
    const NoPath hidden;
    EXPECT_FALSE(filmAvailable());
    try {
        FilmWriter(scratch("none.mp4"), 25);
        FAIL() << "no complaint";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("ffmpeg"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find(".png"), std::string::npos);
    }
    const std::vector<Image> pictures = frames(3);
    FilmWriter film(scratch("walk.png"), 25);
    for (const Image& picture : pictures) {
        film.add(picture);
    }
    film.finish();
    EXPECT_EQ(readPng(scratch("walk_00000.png")), pictures[0]);
    EXPECT_EQ(readPng(scratch("walk_00002.png")), pictures[2]);
}

TEST(Film, badInputIsRefused) {
    EXPECT_EQ(complaint([] { FilmWriter(scratch("film.avi"), 25); }), "film file");
    EXPECT_EQ(complaint([] { FilmWriter(scratch("no/such/film.png"), 25); }), "film file");
    EXPECT_EQ(complaint([] { FilmWriter(scratch("film.png"), 0); }), "framesPerSecond");
    FilmWriter film(scratch("sizes.png"), 25);
    film.add(Image(8, 8));
    EXPECT_EQ(complaint([&] { film.add(Image(8, 9)); }), "film picture");
    EXPECT_EQ(complaint([&] { film.add(Image()); }), "film picture");
    film.finish();
    EXPECT_EQ(complaint([&] { film.add(Image(8, 8)); }), "film picture");
}

// A stand-in for ffmpeg that dies at once: the writer must report its words and live on.
TEST(Film, deathOfFfmpegIsReported) {
    const auto folder = scratch("bin");
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "ffmpeg") << "#!/bin/sh\necho no such codec >&2\nexit 1\n";
    std::filesystem::permissions(folder / "ffmpeg", std::filesystem::perms::owner_all);
    const std::string before = std::getenv("PATH");
    setenv("PATH", (folder.string() + ":" + before).c_str(), 1);
    std::string said;
    try {
        FilmWriter film(scratch("dead.mp4"), 25);
        for (int i = 0; i < 50; ++i) {
            film.add(Image(400, 300));
        }
        film.finish();
    } catch (const std::runtime_error& error) {
        said = error.what();
    }
    setenv("PATH", before.c_str(), 1);
    EXPECT_NE(said.find("no such codec"), std::string::npos) << said;
}

std::string bytesOf(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// ffmpeg itself ends as if all were well when the disk is full.
TEST(Film, fullDiskIsReportedAndLeavesTheOldFilm) {
    if (!filmAvailable()) {
        GTEST_SKIP() << "ffmpeg is not on PATH";
    }
    std::vector<Image> pictures;
    std::mt19937 chance(3);
    for (int i = 0; i < 5; ++i) {
        Image& picture = pictures.emplace_back(64, 64);
        std::generate(picture.rgba.begin(), picture.rgba.end(), [&] { return static_cast<std::uint8_t>(chance()); });
    }
    for (const char* const name : {"full.mp4", "full.gif"}) {
        std::ofstream(scratch(name)) << "the old film";
        std::string said;
        try {
            const test::SmallDisk full(4096);
            FilmWriter film(scratch(name), 25);
            for (const Image& picture : pictures) {
                film.add(picture);
            }
            film.finish();
        } catch (const std::runtime_error& error) {
            said = error.what();
        }
        EXPECT_NE(said.find("File too large"), std::string::npos) << said;
        EXPECT_EQ(bytesOf(scratch(name)), "the old film");
    }
}

TEST(Film, isDroppedWhereItsMakerFails) {
    if (!filmAvailable()) {
        GTEST_SKIP() << "ffmpeg is not on PATH";
    }
    std::ofstream(scratch("dropped.mp4")) << "the old film";
    try {
        FilmWriter film(scratch("dropped.mp4"), 25);
        film.add(Image(32, 32));
        throw std::runtime_error("no more pictures");
    } catch (const std::runtime_error&) {
        EXPECT_EQ(bytesOf(scratch("dropped.mp4")), "the old film");
    }
}

TEST(Film, nothingAddedLeavesNoFile) {
    if (!filmAvailable()) {
        GTEST_SKIP() << "ffmpeg is not on PATH";
    }
    { FilmWriter film(scratch("nothing.mp4"), 25); }
    EXPECT_FALSE(std::filesystem::exists(scratch("nothing.mp4")));
}

}  // namespace
}  // namespace cairn
