#pragma once
// Runs the command as a person or a script does.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace cairn::test {

struct Outcome {
    int code = -1;
    std::string out;
    std::string err;
};

inline std::string slurp(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
}

// A folder of this test case's own, empty at the start.
inline std::filesystem::path scratch() {
    const testing::TestInfo* const info = testing::UnitTest::GetInstance()->current_test_info();
    return std::filesystem::path(CAIRN_BINARY_DIR) / "command_test" / info->name();
}

class Command : public testing::Test {
protected:
    void SetUp() override {
        std::filesystem::remove_all(scratch());
        std::filesystem::create_directories(scratch());
    }

    static Outcome cairn(const std::string& arguments) {
        const std::filesystem::path out = scratch() / "stdout.txt";
        const std::filesystem::path err = scratch() / "stderr.txt";
        const std::string line =
            std::string("'") + CAIRN_COMMAND + "' " + arguments + " >'" + out.string() + "' 2>'" + err.string() + "'";
        const int status = std::system(line.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(out), slurp(err)};
    }

    static nlohmann::json runJson(const std::string& arguments) {
        const Outcome outcome = cairn("run " + arguments + " --json -");
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return nlohmann::json::parse(outcome.out);
    }

    static void expectUsageError(const std::string& arguments, const std::string& inWords) {
        const Outcome outcome = cairn(arguments);
        EXPECT_EQ(outcome.code, 2) << arguments;
        EXPECT_NE(outcome.err.find(inWords), std::string::npos) << arguments << " said: " << outcome.err;
        EXPECT_EQ(outcome.out, "") << arguments;
    }
};

}  // namespace cairn::test
