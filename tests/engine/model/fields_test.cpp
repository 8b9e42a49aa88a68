// The table of fields: every number of every Def has a rule that is kept, and every solver takes what it says.
#include "engine/constraints/list.hpp"
#include "engine/model/describe.hpp"
#include "tests/engine/engine_kit.hpp"

#include <map>
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

    template <class Variant>
    void kind(const char* /*name*/, const Variant& /*def*/, const KindRule& /*rule*/) {}

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
    for (const SolverInfo& info : solverList()) {
        SCOPED_TRACE(info.name);
        expectRulesKept(solverNamed(info.name));
    }
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
    EXPECT_EQ(refusal(WorldDef{.narrowPhase = static_cast<NarrowPhase>(3)}), "def.narrowPhase");
    EXPECT_EQ(refusal(BodyDef{.type = static_cast<BodyType>(-1), .shapes = {unitBox()}}), "def.type");
}

TEST(Fields, ErrorsSayPlaceValueLimitsAndMeaning) {
    try {
        check(WorldDef{.solver = NonlinearGsDef{.stiffness = 1.5}}, "world");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(),
                     "world.solver.stiffness = 1.5: give a number above 0 and of at most 1 (share of an error that a "
                     "sub-step removes)");
    }
}

// How many members an aggregate has.
struct Anything {
    template <class T>
    operator T() const;
};
template <class Aggregate, class... Members>
constexpr std::size_t memberCount() {
    if constexpr (requires { Aggregate{Members{}..., Anything{}}; }) {
        return memberCount<Aggregate, Members..., Anything>();
    } else {
        return sizeof...(Members);
    }
}

// Every field with its value as text.
struct Texts {
    std::map<std::string, std::string> fields;

    template <class T>
    void field(const char* name, const T& value, const FieldRule& /*rule*/) {
        fields[name] = std::to_string(static_cast<double>(value));
    }
};
std::map<std::string, std::string> textsOf(auto def) {
    Texts texts;
    describe(texts, def);
    return texts.fields;
}

// A member without a line in the table would be in no file, unchecked.
TEST(Fields, TheTableHasEveryMemberOfEverySolver) {
    EXPECT_EQ(textsOf(SolverNumbers{}).size(), memberCount<SolverNumbers>());
    std::set<std::string> taken;
    for (const SolverInfo& info : solverList()) {
        SCOPED_TRACE(info.name);
        std::visit(
            [&]<class Def>(const Def& def) {
                EXPECT_EQ(info.fields.size(), memberCount<Def>());
                EXPECT_STREQ(info.name, Def::typeName);
                for (const auto& [name, value] : textsOf(def)) {
                    EXPECT_TRUE(info.takes(name)) << name;
                    EXPECT_EQ(value, textsOf(SolverNumbers{}).at(name)) << name << ": one default for all";
                    taken.insert(name);
                }
            },
            solverNamed(info.name));
    }
    EXPECT_EQ(taken.size(), memberCount<SolverNumbers>()) << "a number that no solver takes";
}

// Each field away from its default.
const std::map<std::string, SolverValue> otherValues = {{"iterations", 3},
                                                        {"substeps", 3},
                                                        {"relaxation", 1.2},
                                                        {"relaxationRule", RelaxationRule::Optimal},
                                                        {"massSplitting", false},
                                                        {"chebyshev", true},
                                                        {"stiffness", 0.5},
                                                        {"postStabilise", false},
                                                        {"refreshRows", false},
                                                        {"penalty", 5},
                                                        {"geometricStiffness", true},
                                                        {"clusterSize", 4},
                                                        {"warmStart", 0.5},
                                                        {"tolerance", 1e-3},
                                                        {"linearSolver", LinearSolver::ConjugateGradients},
                                                        {"directWork", 1e4},
                                                        {"gyroscopicInertia", true}};

TEST(Fields, SetByNameWhereTakenAndRefusedByNameElsewhere) {
    EXPECT_EQ(otherValues.size(), memberCount<SolverNumbers>());
    for (const SolverInfo& info : solverList()) {
        for (const auto& [field, value] : otherValues) {
            SolverDef def = solverNamed(info.name);
            if (!info.takes(field)) {
                EXPECT_THROW(setField(def, field, value), InputError) << info.name << " " << field;
                continue;
            }
            setField(def, field, value);
            const auto before = textsOf(SolverNumbers{});
            for (const auto& [name, text] : textsOf(numbersOf(def))) {
                EXPECT_EQ(text == before.at(name), name != field) << info.name << " " << field << ": " << name;
            }
            EXPECT_EQ(refusal(def), "");
            EXPECT_EQ(textsOf(numbersOf(solverWith(info.name, numbersOf(def)))), textsOf(numbersOf(def)));
        }
    }
}

std::string words(const auto& does) {
    try {
        does();
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(Fields, ByNameErrorsSayWhatToDo) {
    SolverDef def = DirectDef{};
    EXPECT_EQ(
        words([&] { setField(def, "chebyshev", true); }),
        "solver.chebyshev = true with the solver \"direct\", which does not take it: leave it out, or use one that "
        "does: jacobi");
    EXPECT_EQ(words([&] { setField(def, "tolerence", 1e-3); }),
              "solver.tolerence = 0.001: there is no such field; direct takes iterations, substeps, warmStart, "
              "tolerance, linearSolver");
    EXPECT_EQ(words([&] { setField(def, "iterations", 1.5); }),
              "solver.iterations = 1.5: give a whole number (sweeps or Newton iterations a sub-step; 0: the solver's "
              "default)");
    EXPECT_EQ(words([&] { setField(def, "linearSolver", RelaxationRule::Optimal); }),
              "solver.linearSolver = optimal: give a linear solver (how the linear systems of Newton's iterations are "
              "solved)");
    EXPECT_EQ(words([] { solverNamed("gauss"); }),
              "solver.name = \"gauss\": give one of auto, direct, hybrid, gauss_seidel, nncg, cluster, jacobi, "
              "nonlinear_gs, xpbd, vbd, avbd");
}

TEST(Fields, AnotherSolverTakesTheNumbersThatItHasToo) {
    const SolverDef jacobi = JacobiDef{.substeps = 3, .relaxation = 1.2, .chebyshev = true, .warmStart = 0.5};
    const auto xpbd = std::get<XpbdDef>(solverNamed("xpbd", jacobi));
    EXPECT_EQ(xpbd.substeps, 3);
    EXPECT_EQ(xpbd.relaxation, 1.2);
    EXPECT_EQ(textsOf(numbersOf(xpbd)), textsOf(SolverNumbers{.substeps = 3, .relaxation = 1.2}));
}

// A share over 1 gave NaN.
TEST(Fields, RefusedByAWorldAndBySetSolver) {
    Worldd world;
    for (const SolverDef& def :
         {SolverDef(NonlinearGsDef{.stiffness = 1.5}), SolverDef(NonlinearGsDef{.stiffness = 0}),
          SolverDef(NonlinearGsDef{.stiffness = -0.5}), SolverDef(NonlinearGsDef{.stiffness = nan}),
          SolverDef(AvbdDef{.penalty = -1}), SolverDef(VbdDef{.penalty = nan}), SolverDef(VbdDef{.penalty = inf}),
          SolverDef(ClusterDef{.clusterSize = -1})}) {
        EXPECT_THROW(Worldd({.solver = def}), InputError);
        EXPECT_THROW(world.setSolver(def), InputError);
    }
    EXPECT_TRUE(std::holds_alternative<AutoDef>(world.worldDef().solver));
}

}  // namespace
}  // namespace cairn
