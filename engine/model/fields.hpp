#pragma once
// The fields of what a user fills in, told once: describe(archive, def) names each field with its rule to an archive.
// FieldCheck is the archive that everything given to the engine goes through; the reader, the writer, the schema and
// the manual of scene files (assets) are others. What a rule about one field cannot say, because fields must agree with
// each other, validate(def) says beside the describe(). describe.hpp has those of bodies, worlds and deformables, each
// joint its own (engine/constraints).
#include <cairn/input_error.hpp>
#include <cairn/pose.hpp>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <variant>

namespace cairn {

// What a field's value must be. Limits hold for every number of a vector.
struct FieldRule {
    const char* text;  // unit and meaning: the schema's description and a part of error messages
    double min = -std::numeric_limits<double>::infinity();
    double max = std::numeric_limits<double>::infinity();
    bool above = false;  // min itself is not allowed
    bool below = false;  // max itself is not allowed
    bool required = false;
    std::size_t minItems = 0;    // elements of a list
    bool direction = false;      // a vector of any length but 0
    bool mayBeInfinite = false;  // which a file says by leaving it out
    bool fileOnly = false;       // min and max hold in files, where leaving out says what numbers beyond them say

    bool allows(double x) const { return (above ? x > min : x >= min) && (below ? x < max : x <= max); }
    // "a number above 0 and below 2"; `kind` is "a number".
    std::string wanted(const char* kind) const;
};

// What is wrong with a def whose fields are right one by one. `field` may lie within a field ("accuracy.budget"), and
// is empty where it is the def as a whole.
struct Complaint {
    std::string field;
    std::string value;
    std::string remedy;
};

// The words of an enumeration, in order; `what` is what an error asks for.
template <class E>
struct Words;
template <class E>
concept Worded = requires {
    Words<E>::list;
};

// A variant of Defs: files tell which one by its typeName.
struct KindRule {
    const char* what;  // "joint"
    bool required;     // or else the first when left out
};
// The typeNames in order.
template <class Variant>
inline constexpr auto kindNames = []<std::size_t... I>(std::index_sequence<I...>) {
    return std::array{std::variant_alternative_t<I, Variant>::typeName...};
}
(std::make_index_sequence<std::variant_size_v<Variant>>());

template <class Variant>
const char* kindName(const Variant& def) {
    return kindNames<Variant>[def.index()];
}

// At its defaults; `index` into kindNames.
template <class Variant, std::size_t I = 0>
Variant makeKind(std::size_t index) {
    if constexpr (I + 1 < std::variant_size_v<Variant>) {
        if (index != I) {
            return makeKind<Variant, I + 1>(index);
        }
    }
    return Variant(std::in_place_index<I>);
}

// A struct that has a describe().
template <class T>
concept Record = requires(int& archive, T& value) {
    describe(archive, value);
};

// The shortest text that reads as this number again.
inline std::string numberText(double x) {
    char buffer[32];
    const double size = std::abs(x);
    const bool isPlain = x == 0 || (size >= 1e-6 && size < 1e6);
    const auto form = isPlain ? std::chars_format::fixed : std::chars_format::general;
    return {buffer, std::to_chars(buffer, buffer + sizeof buffer, x, form).ptr};
}

inline std::string FieldRule::wanted(const char* kind) const {
    std::string out = kind;
    if (std::isfinite(min)) {
        out += (above ? " above " : " of at least ") + numberText(min);
    }
    if (std::isfinite(max)) {
        out += (std::isfinite(min) ? " and" : "") + std::string(below ? " below " : " of at most ") + numberText(max);
    }
    return out;
}

inline constexpr double shortestDirection = 1e-9;
inline constexpr double shortestQuaternion = 1e-6;
// Its norm is within reach of making it a unit quaternion.
template <class S>
bool isRotation(const Quat<S>& q) {
    return q.coeffs().allFinite() && q.norm() > static_cast<S>(shortestQuaternion);
}

// Holds the fields of a def against their rules, and throws InputError for the first that breaks one.
class FieldCheck {
public:
    explicit FieldCheck(std::string_view name, const FieldCheck* parent = nullptr) : name_(name), parent_(parent) {}

    template <class T>
    void field(const char* name, const T& value, const FieldRule& rule) const {
        if constexpr (std::is_same_v<T, Vec3d>) {
            vector(name, value, rule);
        } else if constexpr (std::is_same_v<T, Quatd>) {
            if (!isRotation(value)) {
                refuse(name, listText(value.coeffs()), "give a unit quaternion x, y, z, w", rule);
            }
        } else if constexpr (Worded<T>) {
            if (static_cast<std::size_t>(value) >= Words<T>::list.size()) {
                refuse(name, "number " + std::to_string(static_cast<long long>(value)),
                       std::string("give ") + Words<T>::what, rule);
            }
        } else if constexpr (Record<T>) {
            const FieldCheck inner(name, this);
            inner.all(value);
        } else if constexpr (std::is_same_v<T, double>) {
            number(name, value, rule, "a number");
        } else if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
            number(name, static_cast<double>(value), rule, "a whole number");
        } else {
            static_assert(std::is_same_v<T, bool> || std::is_same_v<T, std::string> ||
                          std::is_same_v<T, std::array<bool, 3>>);
        }
    }

    template <class Variant>
    void kind(const char* /*name*/, const Variant& /*def*/, const KindRule& /*rule*/) const {}

    // Each of its fields, and whether they agree.
    template <class Def>
    void all(const Def& def) const {
        describe(*this, const_cast<Def&>(def));  // field() takes what it is shown as const
        if constexpr (requires { validate(def); }) {
            const std::optional<Complaint> wrong = validate(def);
            if (wrong) {
                throw InputError(path() + (wrong->field.empty() ? "" : "." + wrong->field), wrong->value,
                                 wrong->remedy);
            }
        }
    }

private:
    template <class Vector>
    static std::string listText(const Vector& list) {
        std::string text;
        for (int k = 0; k < list.size(); ++k) {
            text += (k == 0 ? "(" : ", ") + numberText(list[k]);
        }
        return text + ")";
    }

    void number(const char* name, double value, const FieldRule& rule, const char* kind) const {
        const bool exists = std::isfinite(value) || (rule.mayBeInfinite && !std::isnan(value));
        if (!exists || !(rule.fileOnly || rule.allows(value))) {
            const FieldRule free = {rule.text};
            const bool infinite = !exists && !std::isnan(value);
            refuse(name, numberText(value),
                   "give " + (rule.fileOnly ? free : rule).wanted(infinite ? "a finite number" : kind), rule);
        }
    }

    void vector(const char* name, const Vec3d& value, const FieldRule& rule) const {
        if (!value.allFinite()) {
            refuse(name, listText(value), "give finite numbers", rule);
        }
        for (int k = 0; k < 3; ++k) {
            number(name, value[k], rule, "numbers");
        }
        if (rule.direction && !(value.norm() > shortestDirection)) {
            refuse(name, listText(value), "give a direction, a vector longer than " + numberText(shortestDirection),
                   rule);
        }
    }

    [[noreturn]] void refuse(const char* name, const std::string& value, const std::string& remedy,
                             const FieldRule& rule) const {
        throw InputError(path() + "." + name, value, remedy + " (" + rule.text + ")");
    }

    std::string path() const { return (parent_ != nullptr ? parent_->path() + "." : "") + std::string(name_); }

    std::string_view name_;
    const FieldCheck* parent_;
};

// The one validation: throws InputError with the field, after `name`, its value and what to give instead.
template <Record Def>
void check(const Def& def, std::string_view name) {
    FieldCheck(name).all(def);
}

}  // namespace cairn
