// What the command leaves on the disk when the disk is full, or when it is interrupted.
#include "tests/command/command_kit.hpp"
#include "tests/small_disk.hpp"

namespace {

using namespace cairn::test;

class Files : public Command {
protected:
    static std::string path(const char* name) { return "'" + (scratch() / name).string() + "'"; }

    // Asks the command to end by the signal a second after it has begun to write.
    static Outcome interrupted(const std::string& arguments, int signal) {
        const std::string line =
            "cd '" + scratch().string() + "' || exit; '" + CAIRN_COMMAND + "' " + arguments +
            " >out.txt 2>err.txt & for i in $(seq 1000); do ls .*.part >/dev/null 2>&1 && break; sleep 0.05; done; "
            "sleep 1; "
            "kill -" +
            std::to_string(signal) + " $!; wait $!";
        const int status = std::system(line.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(scratch() / "out.txt"),
                slurp(scratch() / "err.txt")};
    }

    static std::vector<std::string> unfinished() {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::directory_iterator(scratch())) {
            if (entry.path().extension() == ".part") {
                names.push_back(entry.path().filename().string());
            }
        }
        return names;
    }
};

TEST_F(Files, AFullDiskLeavesOldFilesAndIsToldByExitCodes) {
    std::vector<std::string> lines = {"record pile --seconds 1 --out ", "view pile --seconds 1 --html ",
                                      "run pile --seconds 1 --bodies --json ",
                                      "render tower --seconds 0.1 --size 640x480 --out "};
    std::vector<const char*> names = {"old.json", "old.html", "result.json", "old.png"};
    if (std::system("ffmpeg -version >/dev/null 2>&1") == 0) {
        for (const char* const film : {"old.mp4", "old.gif"}) {
            lines.push_back("render wall --set ball=25 --seconds 0.5 --size 640x480 --out ");
            names.push_back(film);
        }
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
        std::ofstream(scratch() / names[i]) << "what was there";
        const Outcome outcome = [&] {
            const SmallDisk full(4096);
            return cairn(lines[i] + path(names[i]));
        }();
        EXPECT_NE(outcome.code, 0) << names[i];
        EXPECT_NE(outcome.err.find("File too large"), std::string::npos) << outcome.err;
        EXPECT_EQ(slurp(scratch() / names[i]), "what was there") << names[i];
    }
    EXPECT_EQ(unfinished(), std::vector<std::string>());
}

TEST_F(Files, DevicesThatTakeNothingAreTold) {
    const Outcome file = cairn("record tower --seconds 0.1 --out /dev/full");
    EXPECT_EQ(file.code, 2);
    EXPECT_NE(file.err.find("--out = /dev/full: it cannot be written (No space left on device)"), std::string::npos)
        << file.err;
    const int status = std::system(
        (std::string("'") + CAIRN_COMMAND + "' run tower --seconds 0.1 --json - >/dev/full 2>" + path("err.txt"))
            .c_str());
    EXPECT_EQ(WEXITSTATUS(status), 1);
    EXPECT_NE(slurp(scratch() / "err.txt").find("standard output cannot be written: No space left on device"),
              std::string::npos);
}

TEST_F(Files, ARecordingKeepsWhatWasMadeBeforeAnInterrupt) {
    for (const int signal : {SIGINT, SIGTERM}) {
        const Outcome outcome = interrupted("record pile --seconds 100000 --out " + path("cut.json"), signal);
        EXPECT_EQ(outcome.code, 130);
        EXPECT_NE(outcome.err.find("of 6000000 steps, which are kept"), std::string::npos) << outcome.err;
        const nlohmann::json file = nlohmann::json::parse(slurp(scratch() / "cut.json"));
        const auto steps = file.at("steps").at("hash").size();
        EXPECT_GT(steps, 0U);
        const Outcome same = cairn("replay --to 1 --json - " + path("cut.json"));
        EXPECT_EQ(same.code, 0) << same.err;
        EXPECT_EQ(nlohmann::json::parse(same.out).at("steps_recorded"), steps);
    }
    const Outcome page = interrupted("view pile --seconds 100000 --html " + path("cut.html"), SIGINT);
    EXPECT_EQ(page.code, 130);
    EXPECT_NE(slurp(scratch() / "cut.html").find("</html>"), std::string::npos);
    EXPECT_EQ(unfinished(), std::vector<std::string>());
}

TEST_F(Files, AnInterruptedFilmIsNotWritten) {
    if (std::system("ffmpeg -version >/dev/null 2>&1") != 0) {
        GTEST_SKIP() << "ffmpeg is not on PATH";
    }
    std::ofstream(scratch() / "old.mp4") << "what was there";
    const Outcome outcome = interrupted("render pile --seconds 10000 --size 160x120 --out " + path("old.mp4"), SIGINT);
    EXPECT_EQ(outcome.code, 130);
    EXPECT_NE(outcome.err.find("the film is not written"), std::string::npos) << outcome.err;
    EXPECT_EQ(slurp(scratch() / "old.mp4"), "what was there");
    EXPECT_EQ(unfinished(), std::vector<std::string>());
}

}  // namespace
