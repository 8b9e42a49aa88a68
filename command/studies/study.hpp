#pragma once
// What the studies of `cairn study` hand back: the command prints, writes and draws it.
#include "command/studies/studies.hpp"
#include "command/table.hpp"

namespace cairn {

struct StudyTable {
    std::string title = {};
    std::string note = {};                            // a line under the title; may be empty
    std::vector<std::vector<std::string>> rows = {};  // as table() takes them
};

struct StudyFigure {
    std::string name = {};  // of the file, without its ending
    Figure figure = {};
};

struct StudyMap {
    std::string name = {};
    std::string svg = {};  // whole document
};

struct StudyOutput {
    std::vector<StudyTable> tables = {};
    std::vector<StudyFigure> figures = {};
    std::vector<StudyMap> maps = {};
    nlohmann::ordered_json json = {};
    std::vector<std::string> broken = {};  // promises that were broken, each in words
};

using StudyFunction = StudyOutput (*)(bool full, const Tell& tell);
StudyOutput studyConvergence(bool full, const Tell& tell);
StudyOutput studyMomentum(bool full, const Tell& tell);
StudyOutput studyEnergy(bool full, const Tell& tell);
StudyOutput studyChain(bool full, const Tell& tell);
StudyOutput studyStacks(bool full, const Tell& tell);
StudyOutput studyClusters(bool full, const Tell& tell);
StudyOutput studyBudgets(bool full, const Tell& tell);
StudyOutput studyGrowth(bool full, const Tell& tell);
StudyOutput studyNarrowPhase(bool full, const Tell& tell);
StudyOutput studyExtremes(bool full, const Tell& tell);
StudyOutput studyTrials(bool full, const Tell& tell);

}  // namespace cairn
