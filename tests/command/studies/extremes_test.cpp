// The default solver far out: whatever is asked, nothing goes non-finite, gains energy or is lost without a flag.
#include "command/studies/studies.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace cairn {
namespace {

// Long ones cost seconds, and are measured by `cairn study extremes`.
bool isShort(const ExtremeAxis& axis, double value) {
    return (axis.name != "stack" && axis.name != "chain") || value <= 20;
}

TEST(ExtremeStudyTest, TheDefaultSolverNeverFailsSilently) {
    for (const ExtremeAxis& axis : extremeAxes()) {
        for (const double value : axis.values) {
            for (const Precision precision : {Precision::Double, Precision::Float}) {
                if (!isShort(axis, value)) {
                    continue;
                }
                const ExtremeEntry e = tryExtreme(axis, value, "auto", precision);
                EXPECT_FALSE(e.failsSilently())
                    << e.axis << " " << e.value << " " << name(precision) << ": " << e.words;
                EXPECT_TRUE(e.verdict != Verdict::Refused || !e.words.empty()) << e.axis << " " << e.value;
                // Nothing hides behind the judge: a soft answer has a number.
                EXPECT_TRUE(std::isfinite(e.error) && std::isfinite(e.energyGained)) << e.axis << " " << e.value;
            }
        }
    }
}

// Cells that once failed, and what mended them: friction so steep that De Saxce's correction carried nothing; a spin of
// many turns a step; moments whose determinant is beyond float.
TEST(ExtremeStudyTest, FarOutHolds) {
    for (const auto& [axis, value] : {std::pair<std::string, double>{"friction", 30},
                                      {"friction", 1e3},
                                      {"spin", 1e4},
                                      {"size", 1e4},
                                      {"distance", 1e4},
                                      {"stiffness", 1e12}}) {
        for (const ExtremeAxis& known : extremeAxes()) {
            for (const Precision precision : {Precision::Double, Precision::Float}) {
                if (known.name == axis) {
                    const ExtremeEntry e = tryExtreme(known, value, "auto", precision);
                    EXPECT_EQ(e.verdict, Verdict::Holds)
                        << axis << " " << value << " " << name(precision) << ", error " << e.error << " " << e.words;
                }
            }
        }
    }
}

TEST(ExtremeStudyTest, WhatIsOrdinaryHolds) {
    for (const auto& [axis, value] : {std::pair<std::string, double>{"mass ratio", 10}, {"stack", 10}, {"size", 1}}) {
        for (const ExtremeAxis& known : extremeAxes()) {
            if (known.name != axis) {
                continue;
            }
            for (const Precision precision : {Precision::Double, Precision::Float}) {
                const ExtremeEntry e = tryExtreme(known, value, "auto", precision);
                EXPECT_EQ(e.verdict, Verdict::Holds) << axis << " " << name(precision) << ", error " << e.error;
                EXPECT_FALSE(e.flagged()) << axis << " " << name(precision);
            }
        }
    }
}

// The judge itself: what leaves its bounds is lost, what misses its place is soft, and what is not allowed is refused.
TEST(ExtremeStudyTest, JudgesByPoses) {
    const auto axis = [](ExtremeScene (*make)(double)) { return ExtremeAxis{"judged", "", {0}, make}; };
    const auto falling = [](double) {
        ExtremeScene s;
        s.scene.seconds = 1;
        s.scene.add({.name = "ball", .shapes = {sphere(0.5)}});
        return s;
    };
    const ExtremeAxis lost = axis([](double) {
        ExtremeScene s;
        s.scene.seconds = 1;
        s.scene.add({.name = "ball", .shapes = {sphere(0.5)}});
        s.min.y() = -1;
        return s;
    });
    const ExtremeAxis missed = axis([](double) {
        ExtremeScene s;
        s.scene.seconds = 1;
        s.scene.add({.name = "ball", .shapes = {sphere(0.5)}});
        s.targets.push_back({.body = 0, .atEnd = true});
        return s;
    });
    const ExtremeAxis refused = axis([](double) {
        ExtremeScene s;
        s.scene.add({.name = "ball", .shapes = {sphere(0.5)}, .mass = -1});
        return s;
    });
    EXPECT_EQ(tryExtreme(axis(falling), 0, "auto", Precision::Double).verdict, Verdict::Holds);
    EXPECT_EQ(tryExtreme(lost, 0, "auto", Precision::Double).verdict, Verdict::Fails);
    const ExtremeEntry soft = tryExtreme(missed, 0, "auto", Precision::Double);
    EXPECT_EQ(soft.verdict, Verdict::Soft);
    EXPECT_NEAR(soft.error, 0.5 * 9.81, 0.1);
    const ExtremeEntry words = tryExtreme(refused, 0, "auto", Precision::Double);
    EXPECT_EQ(words.verdict, Verdict::Refused);
    EXPECT_NE(words.words.find("mass"), std::string::npos);
}

// A picture with a square for every cell.
TEST(ExtremeStudyTest, TheMapHasEveryCell) {
    ExtremeStudy study{.solvers = {"auto"}};
    std::size_t cells = 0;
    for (const ExtremeAxis& axis : extremeAxes()) {
        for (const double value : axis.values) {
            for (const Precision precision : {Precision::Double, Precision::Float}) {
                study.entries.push_back({.axis = axis.name, .value = value, .solver = "auto", .precision = precision});
                ++cells;
            }
        }
    }
    const std::string map = extremeMap(study);
    std::size_t titles = 0;
    for (std::size_t at = map.find("<title>"); at != std::string::npos; at = map.find("<title>", at + 1)) {
        ++titles;
    }
    EXPECT_EQ(titles, cells + 8);  // and the legend
}

}  // namespace
}  // namespace cairn
