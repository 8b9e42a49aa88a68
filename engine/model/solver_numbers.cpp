#include "engine/model/solver_numbers.hpp"
#include "engine/model/describe.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Looks for one field.
template <class T>
struct Find {
    std::string_view name;
    const T* found = nullptr;

    template <class Other>
    void field(const char* field, Other& value, const FieldRule&) {
        if constexpr (std::is_same_v<T, Other>) {
            found = name == field ? &value : found;
        }
    }
};

// Fills each field from the one of that name, where there is one.
template <class From>
struct FillFrom {
    From& from;

    template <class T>
    void field(const char* name, T& value, const FieldRule&) {
        Find<T> find{name};
        describe(find, from);
        if (find.found != nullptr) {
            value = *find.found;
        }
    }
};

template <class From, class To>
void copyShared(From from, To& to) {
    FillFrom<From> fill{from};
    describe(fill, to);
}

struct Names {
    std::vector<std::string_view> names;

    template <class T>
    void field(const char* name, T&, const FieldRule&) {
        names.emplace_back(name);
    }
};

template <class T>
std::string valueText(const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
        return value ? "true" : "false";
    } else if constexpr (Worded<T>) {
        const auto at = static_cast<std::size_t>(value);
        return at < Words<T>::list.size() ? Words<T>::list[at] : "number " + std::to_string(static_cast<int>(value));
    } else {
        return numberText(static_cast<double>(value));
    }
}

// Gives one field a value.
struct Assign {
    std::string_view name;
    const SolverValue& value;
    bool isTaken = false;

    template <class T>
    void field(const char* field, T& place, const FieldRule& rule) {
        if (name != field) {
            return;
        }
        isTaken = true;
        if (const T* const same = std::get_if<T>(&value)) {
            place = *same;
            return;
        }
        if constexpr (std::is_same_v<T, double>) {
            if (const int* const whole = std::get_if<int>(&value)) {
                place = *whole;
                return;
            }
        }
        throw InputError("solver." + std::string(name), text(),
                         std::string("give ") + kindOf<T>() + " (" + rule.text + ")");
    }

    template <class T>
    static const char* kindOf() {
        if constexpr (Worded<T>) {
            return Words<T>::what;
        } else {
            return std::is_same_v<T, bool> ? "true or false" : std::is_same_v<T, int> ? "a whole number" : "a number";
        }
    }

    std::string text() const {
        return std::visit([](const auto& given) { return valueText(given); }, value);
    }
};

std::string listText(const auto& words) {
    std::string out;
    for (const auto& word : words) {
        out += (out.empty() ? "" : ", ") + std::string(word);
    }
    return out;
}

}  // namespace

const std::vector<SolverInfo>& solverList() {
    static const std::vector<SolverInfo> list = [] {
        std::vector<SolverInfo> infos;
        for (std::size_t i = 0; i < std::variant_size_v<SolverDef>; ++i) {
            SolverDef def = makeKind<SolverDef>(i);
            std::visit(
                [&infos](auto& one) {
                    Names fields;
                    describe(fields, one);
                    infos.push_back({one.typeName, one.help, fields.names});
                },
                def);
        }
        return infos;
    }();
    return list;
}

bool SolverInfo::takes(std::string_view field) const {
    return std::find(fields.begin(), fields.end(), field) != fields.end();
}

std::string solverName(const SolverDef& def) {
    return kindName(def);
}

SolverDef solverNamed(std::string_view name) {
    const auto& names = kindNames<SolverDef>;
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
        throw InputError("solver.name", "\"" + std::string(name) + "\"", "give one of " + listText(names));
    }
    return makeKind<SolverDef>(static_cast<std::size_t>(found - names.begin()));
}

SolverDef solverNamed(std::string_view name, const SolverDef& numbers) {
    return solverWith(name, numbersOf(numbers));
}

void setField(SolverDef& def, std::string_view field, const SolverValue& value) {
    Assign assign{field, value};
    std::visit([&assign](auto& one) { describe(assign, one); }, def);
    if (assign.isTaken) {
        return;
    }
    const std::string name = solverName(def);
    if (const std::optional<Complaint> wrong = notTaken(name, field, assign.text())) {
        throw InputError("solver." + wrong->field, wrong->value, wrong->remedy);
    }
    throw InputError("solver." + std::string(field), assign.text(),
                     "there is no such field; " + name + " takes " + listText(solverList()[def.index()].fields));
}

SolverNumbers numbersOf(const SolverDef& def) {
    SolverNumbers numbers;
    std::visit([&numbers](const auto& one) { copyShared(one, numbers); }, def);
    return numbers;
}

SolverDef solverWith(std::string_view name, const SolverNumbers& numbers) {
    SolverDef def = solverNamed(name);
    std::visit([&numbers](auto& one) { copyShared(numbers, one); }, def);
    return def;
}

std::optional<Complaint> notTaken(std::string_view solver, std::string_view field, const std::string& value) {
    std::vector<std::string_view> takers;
    for (const SolverInfo& info : solverList()) {
        if (info.takes(field)) {
            takers.emplace_back(info.name);
        }
    }
    if (takers.empty()) {
        return std::nullopt;
    }
    return Complaint{std::string(field),
                     value + " with the solver \"" + std::string(solver) + "\", which does not take it",
                     "leave it out, or use one that does: " + listText(takers)};
}

}  // namespace cairn
