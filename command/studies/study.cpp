// cairn study: measures the engine's own solvers and draws what it found.
#include "command/studies/study.hpp"
#include "command/command.hpp"

#include <cstdio>

namespace cairn {

namespace {

struct NamedStudy {
    const char* name;
    const char* help;
    StudyFunction run;
};

const std::vector<NamedStudy>& studies() {
    static const std::vector<NamedStudy> list = {
        {"convergence", "iterations on a chain of ten, by method and mass ratio", studyConvergence},
        {"momentum", "what of linear and angular momentum each solver keeps", studyMomentum},
        {"energy", "what of the energy each solver keeps", studyEnergy},
        {"chain", "how far a hanging chain stretches, by sub-steps, iterations and options", studyChain},
        {"stacks", "how far stacks move, and at what cost", studyStacks},
        {"clusters", "error against cost by the size of a cluster: a wall, a heap, a net", studyClusters},
        {"budgets", "what time the steps of the built-in scenes take of a budget, and their error", studyBudgets},
        {"growth", "what a step costs, by bodies, contact points, joints and the share awake", studyGrowth},
        {"narrow_phase", "FCL's narrow phase beside our own: time and error, pair by pair", studyNarrowPhase},
        {"extremes", "where each solver ends: masses, speeds, sizes, steps ... far out (auto; --full: all)",
         studyExtremes},
        {"trials", "every solver on every scene: what is flagged, and the worst of what is not", studyTrials},
    };
    return list;
}

const NamedStudy& findStudy(const std::string& name) {
    std::vector<std::string> names;
    for (const NamedStudy& study : studies()) {
        if (name == study.name) {
            return study;
        }
        names.push_back(study.name);
    }
    throw InputError("study", name,
                     "unknown; did you mean '" + nearestName(name, names) + "'? `cairn study --help` shows all");
}

struct StudyArguments {
    std::string name;
    std::string json;
    std::string out;
    bool full = false;
    bool markdown = false;
};

std::string markdownTable(const std::vector<std::vector<std::string>>& rows) {
    std::string text;
    for (std::size_t r = 0; r < rows.size(); ++r) {
        text += "|";
        for (const std::string& cell : rows[r]) {
            text += " " + (r == 0 && cell.ends_with('<') ? cell.substr(0, cell.size() - 1) : cell) + " |";
        }
        text += "\n";
        if (r == 0) {
            text += "|";
            for (std::size_t c = 0; c < rows[0].size(); ++c) {
                text += c == 0 || rows[0][c].ends_with('<') ? "---|" : "--:|";
            }
            text += "\n";
        }
    }
    return text;
}

void writePicture(const std::string& name, const std::string& picture, const std::filesystem::path& folder) {
    writeText("--out", picture, folder / (name + ".svg"));
}

int runStudy(const StudyArguments& arguments) {
    const NamedStudy& study = findStudy(arguments.name);
    if (!arguments.out.empty()) {
        makeFolder(arguments.out);
    }
    StudyOutput output;
    {
        constexpr int parts = 1000;
        Progress progress(std::string("study ") + study.name, parts);
        output = study.run(arguments.full, [&](double share) { progress.at(static_cast<int>(share * parts)); });
    }
    if (!arguments.json.empty()) {
        output.json["broken"] = output.broken;
        writeJson(output.json, arguments.json);
    }
    if (!arguments.out.empty()) {
        for (const StudyFigure& figure : output.figures) {
            writePicture(figure.name, svg(figure.figure), arguments.out);
        }
        for (const StudyMap& map : output.maps) {
            writePicture(map.name, map.svg, arguments.out);
        }
    }
    if (arguments.json != "-") {
        for (const StudyTable& part : output.tables) {
            std::printf("%s%s\n", arguments.markdown ? "**" : "",
                        (part.title + (arguments.markdown ? "**\n" : "")).c_str());
            if (!part.note.empty()) {
                std::printf("%s\n%s", part.note.c_str(), arguments.markdown ? "\n" : "");
            }
            std::printf("%s\n", (arguments.markdown ? markdownTable(part.rows) : table(part.rows)).c_str());
        }
        if (!arguments.out.empty()) {
            std::printf("figures in %s\n", arguments.out.c_str());
        }
    }
    for (const std::string& words : output.broken) {
        std::fprintf(stderr, "cairn: %s\n", words.c_str());
    }
    return output.broken.empty() ? exitOk : exitBroken;
}

}  // namespace

Action addStudy(CLI::App& app) {
    const auto arguments = std::make_shared<StudyArguments>();
    std::string names;
    for (const NamedStudy& study : studies()) {
        names += std::string(names.empty() ? "" : "; ") + study.name + ": " + study.help;
    }
    app.add_option("study", arguments->name, names)->required();
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without tables");
    app.add_option("--out", arguments->out, "folder for the figures (SVG)");
    app.add_flag("--full", arguments->full, "longer runs and more cases");
    app.add_flag("--markdown", arguments->markdown, "tables as Markdown");
    return [arguments] { return runStudy(*arguments); };
}

}  // namespace cairn
