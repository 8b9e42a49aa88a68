// Files that are whole or not there.
#include "base/output_file.hpp"

#include <cairn/input_error.hpp>

#include "tests/small_disk.hpp"

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>

namespace cairn {
namespace {

class OutputFiles : public testing::Test {
protected:
    void SetUp() override {
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::filesystem::path path(const std::string& name) const { return folder_ / name; }
    static std::string text(const std::filesystem::path& file) {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    }
    std::ptrdiff_t fileCount() const {
        return std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator());
    }
    static std::string complaint(const std::filesystem::path& file, const std::string& bytes) {
        try {
            writeFile("--out", file, bytes);
        } catch (const InputError& error) {
            EXPECT_EQ(error.field(), "--out");
            EXPECT_EQ(error.value(), file.string());
            return error.what();
        }
        return "(written)";
    }

private:
    std::filesystem::path folder_ =
        std::filesystem::temp_directory_path() /
        (std::string("cairn_output_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(OutputFiles, ReplaceWhatWasThereOnlyWhenDone) {
    writeFile("--out", path("a"), "old");
    {
        OutputFile out("--out", path("a"));
        out.write("new");
        EXPECT_EQ(text(path("a")), "old");
        out.finish();
        EXPECT_EQ(text(path("a")), "new");
    }
    EXPECT_EQ(text(path("a")), "new");
    EXPECT_EQ(fileCount(), 1);
}

TEST_F(OutputFiles, LeaveNothingUnlessFinished) {
    writeFile("--out", path("a"), "old");
    { OutputFile(std::string("--out"), path("a")).write("half"); }
    { OutputFile(std::string("--out"), path("b")).write("half"); }
    EXPECT_EQ(text(path("a")), "old");
    EXPECT_EQ(fileCount(), 1);
}

TEST_F(OutputFiles, AFullDiskLeavesTheOldFileAndSaysWhy) {
    writeFile("--out", path("a"), "old");
    {
        const test::SmallDisk full(100000);
        const std::string said = complaint(path("a"), std::string(200000, 'x'));
        EXPECT_NE(said.find("File too large"), std::string::npos) << said;
        EXPECT_NE(said.find("make room"), std::string::npos) << said;
    }
    EXPECT_EQ(text(path("a")), "old");
    EXPECT_EQ(fileCount(), 1);
}

TEST_F(OutputFiles, DevicesAreWrittenToAsTheyAre) {
    EXPECT_EQ(complaint("/dev/null", "gone"), "(written)");
    EXPECT_NE(complaint("/dev/full", "gone").find("No space left on device"), std::string::npos);
    std::filesystem::create_symlink("/dev/full", path("full"));
    EXPECT_NE(complaint(path("full"), "gone").find("No space left on device"), std::string::npos);
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
    EXPECT_EQ(fileCount(), 1);
}

TEST_F(OutputFiles, LinksAndPermissionsStay) {
    writeFile("--out", path("a"), "old");
    std::filesystem::permissions(path("a"), std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    std::filesystem::create_symlink("a", path("link"));
    std::filesystem::create_symlink("b", path("dangling"));
    writeFile("--out", path("link"), "new");
    writeFile("--out", path("dangling"), "new");
    EXPECT_TRUE(std::filesystem::is_symlink(path("link")));
    EXPECT_EQ(text(path("a")), "new");
    EXPECT_EQ(text(path("b")), "new");
    EXPECT_EQ(std::filesystem::status(path("a")).permissions(),
              std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

// Starts a process that writes `file` and never ends by itself; returns when it has begun.
pid_t startWriterOf(const std::filesystem::path& file) {
    std::array<int, 2> begun{};
    EXPECT_EQ(pipe(begun.data()), 0);
    const pid_t child = fork();
    if (child == 0) {
        OutputFile out("--out", file);
        out.write("half");
        std::fflush(out.stream());
        EXPECT_EQ(write(begun[1], "!", 1), 1);
        while (true) {
            pause();
        }
    }
    char said = 0;
    EXPECT_EQ(read(begun[0], &said, 1), 1);
    close(begun[0]);
    close(begun[1]);
    return child;
}

void killProcess(pid_t child) {
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
}

TEST_F(OutputFiles, WhatTheKilledLeaveTheNextRemovesAndNothingOfTheLiving) {
    writeFile("--out", path("other.part"), "not ours");
    writeFile("--out", path(".cairn_notes.part"), "not ours");
    std::filesystem::create_directories(path("folder"));
    const pid_t dead = startWriterOf(path("folder/a"));
    const pid_t alive = startWriterOf(path("folder/b"));
    const auto countIn = [&] { return std::distance(std::filesystem::directory_iterator(path("folder")), {}); };
    killProcess(dead);
    ASSERT_EQ(countIn(), 2);
    std::filesystem::create_symlink(path("other.part"), path("folder/.cairn_1_1.part"));
    writeFile("--out", path("folder/a"), "whole");
    EXPECT_EQ(text(path("folder/a")), "whole");
    EXPECT_EQ(countIn(), 3) << "the result, the living one's part and the link";
    killProcess(alive);
    EXPECT_EQ(fileCount(), 3) << "the two that only look like parts, and the folder";
}

TEST_F(OutputFiles, PlacesThatTakeNoFileAreNamedBeforeAnythingIsWritten) {
    EXPECT_NE(complaint(path("none/a"), "x").find("No such file or directory): make the folder first"),
              std::string::npos);
    EXPECT_NE(complaint(path(""), "x").find("Is a directory"), std::string::npos);
    EXPECT_NE(complaint("", "x").find("cannot be written"), std::string::npos);
    EXPECT_NE(complaint(path(std::string("a\0b", 3)), "x").find("Invalid argument"), std::string::npos);
}

}  // namespace
}  // namespace cairn
