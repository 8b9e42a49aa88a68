// The command `cairn`.
#include <cairn/version.hpp>

#include "assets/control_characters.hpp"
#include "command/command.hpp"
#include "command/interrupt.hpp"
#include "command/mesh_process.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace {

int complain(const std::string& words) {
    std::fprintf(stderr, "cairn: %s\n", cairn::printable(words).c_str());
    return cairn::exitUsage;
}

// What went to standard output is only known to have arrived when all of it is out.
int concluded(int exitCode) {
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
        std::fprintf(stderr, "cairn: standard output cannot be written: %s\n", std::strerror(errno));
        return exitCode == cairn::exitOk ? cairn::exitBroken : exitCode;
    }
    return exitCode;
}

}  // namespace

int main(int argc, char** argv) {
    if (const std::optional<int> done = cairn::readMeshForParent(argc, argv)) {
        return *done;
    }
    CLI::App app("Rigid-body physics whose error is known: runs, measures and draws scenes.", "cairn");
    app.set_version_flag("--version", std::string("cairn ") + cairn::version);
    app.require_subcommand(1);
    std::vector<std::pair<CLI::App*, cairn::Action>> commands;
    const auto add = [&](const char* name, const char* help, cairn::Action (*addOptions)(CLI::App&)) {
        CLI::App* const command = app.add_subcommand(name, help);
        commands.emplace_back(command, addOptions(*command));
    };
    add("list", "built-in scenes with their parameters, and solvers", cairn::addList);
    add("run", "run a scene and report cost and error", cairn::addRun);
    add("render", "pictures or a film of a scene", cairn::addRender);
    add("record", "run a scene into a file that replay and view take", cairn::addRecord);
    add("replay", "make a recorded run again and compare it bit for bit", cairn::addReplay);
    add("view", "a page that plays a scene or a recording in a browser, with its error", cairn::addView);
    add("demo", "run the demonstration scenes: pictures, a film and a table", cairn::addDemo);
    add("check", "what will be hard about a scene, before it is run", cairn::addCheck);
    add("explain", "what a scene makes the engine model, why, and what each costs", cairn::addExplain);
    add("tune", "measure which settings serve a scene best, by error and cost", cairn::addTune);
    add("bench", "what the built-in scenes cost, err and ask of the engine", cairn::addBench);
    add("compare", "one scene on Cairn and on other engines over their dials", cairn::addCompare);
    add("study", "measure the solvers: convergence, momentum, energy, chain, stacks, clusters, extremes",
        cairn::addStudy);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {
            return app.exit(error);  // --help
        }
        std::string words = error.what();
        if (argc > 1 && argv[1][0] != '-' && app.get_subcommands().empty()) {
            std::vector<std::string> names;
            names.reserve(commands.size());
            for (const auto& entry : commands) {
                names.push_back(entry.first->get_name());
            }
            words = "unknown command '" + std::string(argv[1]) + "'; did you mean '" +
                    cairn::nearestName(argv[1], names) + "'?";
        }
        return complain(words + " (cairn --help shows the usage)");
    }
    try {
        for (const auto& [command, action] : commands) {
            if (command->parsed()) {
                return concluded(action());
            }
        }
    } catch (const cairn::InputError& error) {
        return complain(error.what());
    } catch (const cairn::Interrupted& error) {
        std::fprintf(stderr, "cairn: %s\n", error.what());
        return cairn::exitInterrupted;
    } catch (const std::bad_alloc&) {
        return complain("not enough memory: give a smaller scene, or more memory");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "cairn: %s\n", error.what());
        return cairn::exitBroken;
    }
    return cairn::exitUsage;
}
