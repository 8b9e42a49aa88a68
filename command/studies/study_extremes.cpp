#include "command/studies/study.hpp"

namespace cairn {

namespace {

std::string cellOf(const ExtremeEntry& e) {
    std::string cell = e.verdict == Verdict::Soft ? brief(e.error) : name(e.verdict);
    return cell + (e.flagged() && e.verdict != Verdict::Refused ? " !" : "");
}

StudyTable axisTable(const ExtremeStudy& study, const ExtremeAxis& axis) {
    StudyTable out{.title = axis.name + (axis.unit.empty() ? "" : ", " + axis.unit), .rows = {{"solver", "in<"}}};
    for (const double value : axis.values) {
        out.rows[0].push_back(brief(value));
    }
    for (const std::string& solver : study.solvers) {
        for (const Precision precision : {Precision::Double, Precision::Float}) {
            std::vector<std::string> row = {solver, name(precision)};
            for (const double value : axis.values) {
                row.push_back(cellOf(study.at(axis.name, value, solver, precision)));
            }
            out.rows.push_back(row);
        }
    }
    return out;
}

StudyTable countTable(const ExtremeStudy& study) {
    StudyTable out{.title = "Extremes",
                   .note =
                       "Cells by verdict. Below: \"holds\", or a number, the error in m where it is soft; ! some "
                       "step raised a flag.",
                   .rows = {{"solver", "in<", "holds", "soft", "of these flagged", "refused", "fails, and says so",
                             "fails unsaid"}}};
    for (const std::string& solver : study.solvers) {
        for (const Precision precision : {Precision::Double, Precision::Float}) {
            std::array<int, 6> counts = {};
            for (const ExtremeEntry& e : study.entries) {
                if (e.solver != solver || e.precision != precision) {
                    continue;
                }
                counts[0] += e.verdict == Verdict::Holds ? 1 : 0;
                counts[1] += e.verdict == Verdict::Soft ? 1 : 0;
                counts[2] += e.verdict == Verdict::Soft && e.flagged() ? 1 : 0;
                counts[3] += e.verdict == Verdict::Refused ? 1 : 0;
                counts[4] += e.verdict == Verdict::Fails && e.flagged() ? 1 : 0;
                counts[5] += e.failsSilently() ? 1 : 0;
            }
            std::vector<std::string> row = {solver, name(precision)};
            for (const int count : counts) {
                row.push_back(std::to_string(count));
            }
            out.rows.push_back(row);
        }
    }
    return out;
}

}  // namespace

StudyOutput studyExtremes(bool full, const Tell& tell) {
    std::vector<std::string> solvers = {"auto"};
    if (full) {
        solvers.clear();
        for (const SolverInfo& info : solverList()) {
            solvers.push_back(info.name);
        }
    }
    const ExtremeStudy study = extremeStudy(solvers, tell);
    StudyOutput out;
    out.json = toJson(study);
    out.tables = {countTable(study)};
    for (const ExtremeAxis& axis : extremeAxes()) {
        out.tables.push_back(axisTable(study, axis));
    }
    StudyTable why{.title = "What was refused and what failed", .rows = {{"axis", "value", "solver<", "in<", "why<"}}};
    for (const ExtremeEntry& e : study.entries) {
        if (!e.words.empty()) {
            why.rows.push_back({e.axis, brief(e.value), e.solver, name(e.precision),
                                e.words + (e.verdict == Verdict::Fails && e.flagged() ? " (flagged)" : "")});
        }
        if (e.failsSilently()) {
            out.broken.push_back(e.solver + " in " + name(e.precision) + " at " + e.axis + " " + brief(e.value) + ": " +
                                 e.words + ", and no flag says so");
        }
    }
    out.tables.push_back(why);
    out.maps = {{"extremes", extremeMap(study)}};
    return out;
}

}  // namespace cairn
