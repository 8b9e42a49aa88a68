// The table of fields: every number of every Def has a rule that is kept, and every solver takes what it says.
#include "engine/constraints/list.hpp"
#include "engine/model/describe.hpp"
#include "tests/engine/engine_kit.hpp"

#include <set>

namespace cairn {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

// Calls visit(path, number, rule) for each number of a def, those of the Defs within it included.
template <class Visit>
class Numbers {
public:
    explicit Numbers(const Visit& visit, std::string path = "") : visit_(visit), path_(std::move(path)) {}

    template <class T>
    void field(const char* name, T& value, const FieldRule& rule) {
        const std::string path = path_ + "." + name;
        if constexpr (std::is_same_v<T, Vec3d>) {
            for (int k = 0; k < 3; ++k) {
                visit_(path, value[k], rule);
            }
        } else if constexpr (std::is_same_v<T, Quatd>) {
            visit_(path, value.x(), rule);
        } else if constexpr (Record<T>) {
            Numbers inner(visit_, path);
            describe(inner, value);
        } else if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
            visit_(path, value, rule);
        }
    }

private:
    const Visit& visit_;
    std::string path_;
};

template <class Def, class Visit>
void eachNumber(Def& def, const Visit& visit) {
    Numbers<Visit> numbers(visit);
    describe(numbers, def);
}

template <class Def>
std::string refusal(const Def& def) {
    try {
        check(def, "def");
    } catch (const InputError& error) {
        const std::string text = error.what();
        EXPECT_TRUE(text.find("give ") != std::string::npos || text.find("leave it out") != std::string::npos) << text;
        return error.field();
    }
    return "";
}

// Puts each number of `good` beyond its limits, one at a time: check() names it.
template <class Def>
void expectRulesKept(const Def& good) {
    EXPECT_EQ(refusal(good), "");
    std::size_t count = 0;
    Def counted = good;
    eachNumber(counted, [&](const std::string&, auto&, const FieldRule&) { ++count; });
    for (std::size_t n = 0; n < count; ++n) {
        const auto refuses = [&](double value) {
            Def bad = good;
            std::string path;
            std::size_t at = 0;
            eachNumber(bad, [&]<class T>(const std::string& name, T& number, const FieldRule&) {
                if (at++ == n) {
                    path = name;
                    number = static_cast<T>(value);
                }
            });
            EXPECT_EQ(refusal(bad), "def" + path) << value;
        };
        bool whole = false;
        FieldRule rule{""};
        std::size_t at = 0;
        Def looked = good;
        eachNumber(looked, [&]<class T>(const std::string&, T&, const FieldRule& r) {
            if (at++ == n) {
                whole = std::is_integral_v<T>;
                rule = r;
            }
        });
        if (!whole) {
            refuses(nan);
            if (!rule.mayBeInfinite) {
                refuses(inf);
                refuses(-inf);
            }
        }
        if (rule.fileOnly || rule.min == -2147483648.0 || rule.max == 4294967295.0) {
            continue;  // no limits here, or those of the type itself
        }
        if (std::isfinite(rule.min)) {
            refuses(rule.min - 1);
            if (rule.above) {
                refuses(rule.min);
            }
        }
        if (std::isfinite(rule.max)) {
            refuses(rule.max + 1);
            if (rule.below) {
                refuses(rule.max);
            }
        }
    }
}

TEST(Fields, EveryRuleIsKept) {
    expectRulesKept(SolverDef{});
    expectRulesKept(SleepDef{});
    expectRulesKept(AccuracyDef{});
    expectRulesKept(WorldDef{});
    expectRulesKept(Material{});
    expectRulesKept(Filter{});
    expectRulesKept(BodyDef{.shapes = {unitBox()}});
    expectRulesKept(Attachment{});
    expectRulesKept(RopeDef{});
    expectRulesKept(ClothDef{});
    expectRulesKept(SoftBodyDef{});
    expectRulesKept(Softness{.compliance = 1});
    expectRulesKept(BallDef{});
    expectRulesKept(ConeTwistDef{});
    expectRulesKept(LinearMotorDef{});
    expectRulesKept(AngularMotorDef{});
    expectRulesKept(SpringDef{.softness = {.compliance = 1}});
}

TEST(Fields, WordsBeyondTheListAreRefused) {
    EXPECT_EQ(refusal(WorldDef{.gyroscopic = static_cast<GyroscopicRule>(9)}), "def.gyroscopic");
    EXPECT_EQ(refusal(BodyDef{.type = static_cast<BodyType>(-1), .shapes = {unitBox()}}), "def.type");
}

TEST(Fields, ErrorsSayPlaceValueLimitsAndMeaning) {
    try {
        check(WorldDef{.solver = {.name = "nonlinear_gs", .stiffness = 1.5}}, "world");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(),
                     "world.solver.stiffness = 1.5: give a number above 0 and of at most 1 (share of an error that a "
                     "sub-step removes)");
    }
}

// Each field of SolverDef away from its default, alone.
template <class Visit>
void eachChange(const Visit& visit) {
    const auto one = [&](const char* name, const auto& change) {
        SolverDef def;
        change(def);
        visit(name, def);
    };
    one("iterations", [](SolverDef& d) { d.iterations = 3; });
    one("substeps", [](SolverDef& d) { d.substeps = 3; });
    one("relaxation", [](SolverDef& d) { d.relaxation = 1.2; });
    one("relaxationRule", [](SolverDef& d) { d.relaxationRule = RelaxationRule::Optimal; });
    one("massSplitting", [](SolverDef& d) { d.massSplitting = false; });
    one("chebyshev", [](SolverDef& d) { d.chebyshev = true; });
    one("stiffness", [](SolverDef& d) { d.stiffness = 0.5; });
    one("postStabilise", [](SolverDef& d) { d.postStabilise = false; });
    one("refreshRows", [](SolverDef& d) { d.refreshRows = false; });
    one("penalty", [](SolverDef& d) { d.penalty = 5; });
    one("geometricStiffness", [](SolverDef& d) { d.geometricStiffness = true; });
    one("clusterSize", [](SolverDef& d) { d.clusterSize = 4; });
    one("warmStart", [](SolverDef& d) { d.warmStart = 0.5; });
    one("tolerance", [](SolverDef& d) { d.tolerance = 1e-3; });
    one("linearSolver", [](SolverDef& d) { d.linearSolver = LinearSolver::ConjugateGradients; });
    one("directWork", [](SolverDef& d) { d.directWork = 1e4; });
    one("gyroscopicInertia", [](SolverDef& d) { d.gyroscopicInertia = true; });
}

struct Names {
    std::set<std::string>& names;
    void field(const char* name, const auto& /*value*/, const FieldRule& /*rule*/) { names.insert(name); }
};

TEST(Fields, SolversNameFieldsThatThereAre) {
    std::set<std::string> known;
    Names names{known};
    SolverDef def;
    describe(names, def);
    std::set<std::string> taken = {"name"};
    for (const SolverInfo& info : solverList()) {
        std::istringstream words(info.fields);
        for (std::string word; words >> word;) {
            EXPECT_TRUE(known.contains(word)) << info.name << " takes " << word;
            taken.insert(word);
        }
    }
    EXPECT_EQ(taken, known) << "a field that no solver takes";
    std::set<std::string> changed = {"name"};
    eachChange([&](const char* name, const SolverDef&) { changed.insert(name); });
    EXPECT_EQ(changed, known) << "eachChange() above lacks a field";
}

TEST(Fields, WhatASolverDoesNotTakeIsRefusedByName) {
    for (const SolverInfo& info : solverList()) {
        eachChange([&](const std::string& field, SolverDef def) {
            def.name = info.name;
            const bool takes = info.takes(field);
            EXPECT_EQ(refusal(def), takes ? "" : "def." + field) << info.name;
            EXPECT_EQ(refusal(onlyTaken(def)), "") << info.name;
        });
    }
    try {
        Worldd({.solver = {.name = "direct", .chebyshev = true}});
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(),
                     "world.solver.chebyshev = true with the solver \"direct\", which does not take it: leave it out, "
                     "or use one that does: jacobi");
    }
}

TEST(Fields, OnlyTakenKeepsWhatIsTaken) {
    SolverDef def{.name = "jacobi", .substeps = 3, .relaxation = 1.2, .chebyshev = true, .warmStart = 0.5};
    def.name = "xpbd";
    const SolverDef kept = onlyTaken(def);
    EXPECT_EQ(kept.substeps, 3);
    EXPECT_EQ(kept.relaxation, 1.2);
    EXPECT_FALSE(kept.chebyshev);
    EXPECT_EQ(kept.warmStart, 1);
}

// A share over 1 gave NaN.
TEST(Fields, RefusedByAWorldAndBySetSolver) {
    Worldd world;
    for (const SolverDef& def :
         {SolverDef{.name = "nonlinear_gs", .stiffness = 1.5}, SolverDef{.name = "nonlinear_gs", .stiffness = 0},
          SolverDef{.name = "nonlinear_gs", .stiffness = -0.5}, SolverDef{.name = "nonlinear_gs", .stiffness = nan},
          SolverDef{.name = "avbd", .penalty = -1}, SolverDef{.name = "vbd", .penalty = nan},
          SolverDef{.name = "vbd", .penalty = inf}, SolverDef{.name = "cluster", .clusterSize = -1}}) {
        EXPECT_THROW(Worldd({.solver = def}), InputError);
        EXPECT_THROW(world.setSolver(def), InputError);
    }
    EXPECT_EQ(world.worldDef().solver.name, "auto");
}

}  // namespace
}  // namespace cairn
