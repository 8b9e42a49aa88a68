// cairn list: what there is to run.
#include <cairn/cairn.hpp>

#include "command/command.hpp"

#include <cstdio>

namespace cairn {

namespace {

std::string rangeOf(const SceneParameter& parameter) {
    if (parameter.choices.empty()) {
        return brief(parameter.min) + " to " + brief(parameter.max);
    }
    std::string words;
    for (const std::string& choice : parameter.choices) {
        words += (words.empty() ? "" : "|") + choice;
    }
    return words;
}

std::string standardOf(const SceneParameter& parameter) {
    return parameter.choices.empty() ? brief(parameter.standard)
                                     : parameter.choices[static_cast<std::size_t>(parameter.standard)];
}

std::string fieldsOf(const SolverInfo& solver) {
    std::string words;
    for (const std::string_view field : solver.fields) {
        words += (words.empty() ? "" : " ") + std::string(field);
    }
    return words;
}

nlohmann::ordered_json listJson() {
    nlohmann::ordered_json json;
    json["scenes"] = nlohmann::ordered_json::array();
    for (const BuiltinScene& scene : builtinScenes()) {
        nlohmann::ordered_json parameters = nlohmann::ordered_json::array();
        for (const SceneParameter& parameter : scene.parameters) {
            parameters.push_back({{"name", parameter.name},
                                  {"default", parameter.standard},
                                  {"min", parameter.min},
                                  {"max", parameter.max},
                                  {"help", parameter.help}});
            if (!parameter.choices.empty()) {
                parameters.back()["choices"] = parameter.choices;
            }
        }
        json["scenes"].push_back({{"name", scene.name}, {"help", scene.help}, {"parameters", parameters}});
    }
    json["solvers"] = nlohmann::ordered_json::array();
    for (const SolverInfo& solver : solverList()) {
        json["solvers"].push_back({{"name", solver.name}, {"help", solver.help}, {"fields", fieldsOf(solver)}});
    }
    return json;
}

}  // namespace

Action addList(CLI::App& app) {
    const auto json = std::make_shared<std::string>();
    app.add_option("--json", *json, "write JSON to FILE instead; - is standard output");
    return [json] {
        if (!json->empty()) {
            writeJson(listJson(), *json);
            return exitOk;
        }
        for (const BuiltinScene& scene : builtinScenes()) {
            std::printf("%-14s %s\n", scene.name.c_str(), scene.help.c_str());
            for (const SceneParameter& parameter : scene.parameters) {
                std::printf("    %-12s %-8s %s (%s)\n", parameter.name.c_str(), standardOf(parameter).c_str(),
                            parameter.help.c_str(), rangeOf(parameter).c_str());
            }
        }
        std::printf("\nsolvers\n");
        for (const SolverInfo& solver : solverList()) {
            std::printf("    %-12s %s\n    %-12s takes %s\n", solver.name, solver.help, "", fieldsOf(solver).c_str());
        }
        return exitOk;
    };
}

}  // namespace cairn
