// The archive that reads: JSON values into the structs of scene_file.hpp, every error with its place.
#include "assets/control_characters.hpp"
#include "assets/nearest.hpp"
#include "assets/scene_file.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

namespace cairn::scene_file {

namespace {

using nlohmann::json;

std::string escaped(const std::string& key) {
    std::string out;
    for (const char c : printable(key)) {
        out += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
    }
    return out;
}

// Where a value stands: a chain on the stack, made into a JSON pointer only when there is something to say.
struct Place {
    const std::string& file;
    const Place* parent = nullptr;
    const char* key = nullptr;  // nullptr: an element of a list
    std::size_t index = 0;

    std::string pointer() const {
        if (parent == nullptr) {
            return file + ":";
        }
        return parent->pointer() + "/" + (key != nullptr ? escaped(key) : std::to_string(index));
    }
    Place at(const char* k) const { return {file, this, k}; }
    Place at(std::size_t i) const { return {file, this, nullptr, i}; }
};

std::string shown(const json& value) {
    constexpr std::size_t maxShown = 60;
    if (value.is_structured() && value.size() > 8) {
        return value.is_array() ? "a list of " + std::to_string(value.size()) + " values" : "an object";
    }
    std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
    if (text.size() > maxShown) {
        text = text.substr(0, maxShown) + "...";
    }
    return text;
}

std::string shown(double value) {
    return json(value).dump();
}

[[noreturn]] void fail(const Place& place, const json& value, const std::string& wanted, const Rule& rule) {
    throw InputError(place.pointer(), shown(value), "give " + wanted + " (" + rule.text + ")");
}

class ObjectReader {
public:
    ObjectReader(const json& node, const Place& place) : node_(node), place_(place) {}

    template <class T>
    void field(const char* name, T& value, const Rule& rule) {
        known_.emplace_back(name);
        const auto found = node_.find(name);
        if (found != node_.end()) {
            readValue(*found, place_.at(name), value, rule);
        } else if (rule.required && missing_.empty()) {
            missing_ = name;
            missingText_ = rule.text;
        }
    }

    template <class Variant>
    void kind(const char* name, Variant& def, const KindRule& rule) {
        known_.emplace_back(name);
        const auto found = node_.find(name);
        const std::vector<std::string> words(kindNames<Variant>.begin(), kindNames<Variant>.end());
        if (found != node_.end()) {
            def = makeKind<Variant>(word(*found, place_.at(name), words, std::string("a ") + rule.what));
        } else if (rule.required) {
            throw InputError(place_.pointer() + "/" + name, "(missing)",
                             std::string("say which ") + rule.what + "; " + suggestion("", words));
        }
        if constexpr (std::is_same_v<Variant, SolverDef>) {
            solver_ = kindName(def);
        }
    }

    void oneOf(std::initializer_list<const char*> names) { choices_.assign(names.begin(), names.end()); }

    void together(const char* first, const char* second) {
        if (node_.contains(first) != node_.contains(second)) {
            const char* given = node_.contains(first) ? first : second;
            halves_ = {given, given == first ? second : first};
        }
    }

    // A misspelt field says more than the field that is missing for it, so it goes first.
    void finish() const {
        for (const auto& [key, value] : node_.items()) {
            if (std::find(known_.begin(), known_.end(), key) != known_.end()) {
                continue;
            }
            const std::string pointer = place_.at(key.c_str()).pointer();
            const std::optional<Complaint> ofOthers =
                solver_.empty() ? std::nullopt : notTaken(solver_, key, shown(value));
            if (ofOthers) {
                throw InputError(pointer, ofOthers->value, ofOthers->remedy);
            }
            throw InputError(pointer, shown(value), "there is no such field; " + suggestion(key, known_));
        }
        if (!missing_.empty()) {
            throw InputError(place_.pointer() + "/" + missing_, "(missing)",
                             "this field is required (" + missingText_ + ")");
        }
        const auto isGiven = [this](const std::string& name) { return node_.contains(name); };
        const auto given = std::count_if(choices_.begin(), choices_.end(), isGiven);
        if (!choices_.empty() && given != 1) {
            std::string list;
            std::string present;
            for (const std::string& name : choices_) {
                list += " " + name;
                present += isGiven(name) ? (present.empty() ? "" : " and ") + name : "";
            }
            throw InputError(place_.pointer(), given == 0 ? shown(node_) : present, "give exactly one of:" + list);
        }
        if (!halves_.first.empty()) {
            throw InputError(place_.pointer() + "/" + halves_.second, "(missing)",
                             halves_.first + " and " + halves_.second + " go together");
        }
    }

private:
    static std::size_t word(const json& value, const Place& place, const std::vector<std::string>& words,
                            const std::string& what) {
        const auto found =
            value.is_string() ? std::find(words.begin(), words.end(), value.get<std::string>()) : words.end();
        if (found == words.end()) {
            throw InputError(
                place.pointer(), shown(value),
                "name " + what + "; " + suggestion(value.is_string() ? value.get<std::string>() : "", words));
        }
        return static_cast<std::size_t>(found - words.begin());
    }

    static double number(const json& value, const Place& place, const Rule& rule, const char* kind = "a number") {
        if (!value.is_number()) {
            fail(place, value, kind, rule);
        }
        const double x = value.get<double>();
        if (!rule.allows(x)) {
            fail(place, value, rule.wanted(kind), rule);
        }
        return x;
    }

    template <class Integer>
    static void integer(const json& value, const Place& place, Integer& out, const Rule& rule) {
        Rule bounded = rule;
        bounded.min = std::max(rule.min, static_cast<double>(std::numeric_limits<Integer>::min()));
        bounded.max = std::min(rule.max, static_cast<double>(std::numeric_limits<Integer>::max()));
        const double x = number(value, place, bounded, "a whole number");
        if (x != std::floor(x)) {
            fail(place, value, "a whole number", rule);
        }
        out = static_cast<Integer>(x);
    }

    static void list(const json& value, const Place& place, std::size_t size, const char* of, const Rule& rule) {
        if (!value.is_array() || value.size() != size) {
            fail(place, value, "a list of " + std::to_string(size) + " " + of, rule);
        }
    }

    static void readValue(const json& value, const Place& place, double& out, const Rule& rule) {
        out = number(value, place, rule);
    }
    static void readValue(const json& value, const Place& place, Height& out, const Rule& rule) {
        out.value = value.is_null() ? std::numeric_limits<double>::quiet_NaN() : number(value, place, rule);
    }
    static void readValue(const json& value, const Place& place, int& out, const Rule& rule) {
        integer(value, place, out, rule);
    }
    static void readValue(const json& value, const Place& place, std::uint32_t& out, const Rule& rule) {
        integer(value, place, out, rule);
    }

    static void readValue(const json& value, const Place& place, bool& out, const Rule& rule) {
        if (!value.is_boolean()) {
            fail(place, value, "true or false", rule);
        }
        out = value.get<bool>();
    }

    static void readValue(const json& value, const Place& place, std::string& out, const Rule& rule) {
        if (!value.is_string()) {
            fail(place, value, "a text in quotes", rule);
        }
        out = value.get<std::string>();
        // A description may have lines.
        std::string line = out;
        if (place.key != nullptr && std::string_view(place.key) == "description") {
            std::erase_if(line, [](char c) { return c == '\n' || c == '\t'; });
        }
        if (hasControls(line)) {
            fail(place, value, "a text without control characters", rule);
        }
    }

    template <Worded E>
    static void readValue(const json& value, const Place& place, E& out, const Rule&) {
        out = static_cast<E>(word(value, place, {Words<E>::list.begin(), Words<E>::list.end()}, Words<E>::what));
    }

    static void readValue(const json& value, const Place& place, BodyRef& out, const Rule& rule) {
        if (value.is_string()) {
            out.name = value.get<std::string>();
        } else if (value.is_number()) {
            Rule atLeastZero = rule;
            atLeastZero.min = 0;
            integer(value, place, out.index, atLeastZero);
        } else {
            fail(place, value, "a body's name or index", rule);
        }
    }

    static void readValue(const json& value, const Place& place, Vec3d& out, const Rule& rule) {
        list(value, place, 3, "numbers", rule);
        for (std::size_t i = 0; i < 3; ++i) {
            out[static_cast<int>(i)] = number(value[i], place.at(i), rule);
        }
        if (rule.direction && !(out.norm() > shortestDirection)) {
            fail(place, value, "a direction, a vector longer than " + shown(shortestDirection), rule);
        }
    }

    static void readValue(const json& value, const Place& place, Quatd& out, const Rule& rule) {
        list(value, place, 4, "numbers", rule);
        Eigen::Vector4d q;
        for (std::size_t i = 0; i < 4; ++i) {
            q[static_cast<int>(i)] = number(value[i], place.at(i), rule);
        }
        const double norm = q.stableNorm();
        if (!(norm > shortestQuaternion)) {
            fail(place, value, "a quaternion that is not zero; no turn is [0, 0, 0, 1]", rule);
        }
        // A unit quaternion is left as it is, so that what was written is read back to the last bit.
        constexpr double unitTolerance = 1e-12;
        out.coeffs() = std::abs(norm - 1) < unitTolerance ? q : Eigen::Vector4d(q / norm);
    }

    template <class T, std::size_t N>
    static void readValue(const json& value, const Place& place, std::array<T, N>& out, const Rule& rule) {
        list(value, place, N, std::is_same_v<T, bool> ? "times true or false" : "numbers", rule);
        for (std::size_t i = 0; i < N; ++i) {
            readValue(value[i], place.at(i), out[i], rule);
        }
    }

    template <class T>
    static void readValue(const json& value, const Place& place, std::vector<T>& out, const Rule& rule) {
        if (!value.is_array()) {
            fail(place, value, "a list", rule);
        }
        if (value.size() < rule.minItems) {
            fail(place, value, "a list of at least " + std::to_string(rule.minItems), rule);
        }
        Rule ofElements = rule;
        ofElements.minItems = 0;
        out.resize(value.size());
        for (std::size_t i = 0; i < out.size(); ++i) {
            readValue(value[i], place.at(i), out[i], ofElements);
        }
    }

    template <class T>
    static void readValue(const json& value, const Place& place, std::optional<T>& out, const Rule& rule) {
        readValue(value, place, out.emplace(), rule);
    }

    template <class T>
    static void readValue(const json& value, const Place& place, std::map<std::string, T>& out, const Rule& rule) {
        if (!value.is_object()) {
            fail(place, value, "an object", rule);
        }
        for (const auto& [key, element] : value.items()) {
            if (hasControls(key)) {
                fail(place, key, "names without control characters", rule);
            }
            readValue(element, place.at(key.c_str()), out[key], rule);
        }
    }

    template <Record Struct>
    static void readValue(const json& value, const Place& place, Struct& out, const Rule& rule) {
        if (!value.is_object()) {
            fail(place, value, "an object", rule);
        }
        ObjectReader reader(value, place);
        describe(reader, out);
        reader.finish();
        if constexpr (requires { validate(out); }) {
            const std::optional<Complaint> wrong = validate(out);
            if (wrong) {
                std::string field = wrong->field;
                std::replace(field.begin(), field.end(), '.', '/');
                throw InputError(place.pointer() + (field.empty() ? "" : "/" + field), wrong->value, wrong->remedy);
            }
        }
    }

    friend SceneFile readFile(const json& root, const std::string& name);

    const json& node_;
    const Place& place_;
    std::vector<std::string> known_;
    std::string missing_;
    std::string missingText_;
    std::string solver_;  // whose numbers these are, if a solver's
    std::vector<std::string> choices_;
    std::pair<std::string, std::string> halves_;  // given, missing
};

SceneFile readFile(const json& root, const std::string& name) {
    SceneFile file;
    ObjectReader::readValue(root, Place{name}, file, {"a scene: at the least { \"cairn\": 1, \"bodies\": [] }"});
    return file;
}

// Keeps track of where the parser is, and finds what it would take without a word: a field given twice (the last one
// wins) and nesting deep enough to end the program.
class ParseGuard {
public:
    explicit ParseGuard(const std::string& file) : file_(file) {}

    bool operator()(int, json::parse_event_t event, json& parsed) {
        switch (event) {
            case json::parse_event_t::object_start:
            case json::parse_event_t::array_start:
                countElement();
                open_.push_back({event == json::parse_event_t::array_start, 0, {}, {}});
                if (open_.size() > deepest) {
                    throw InputError(file_ + ":", "nested " + std::to_string(open_.size()) + " deep",
                                     "no scene is nested so deep; check the brackets");
                }
                break;
            case json::parse_event_t::object_end:
            case json::parse_event_t::array_end:
                open_.pop_back();
                break;
            case json::parse_event_t::key: {
                Level& level = open_.back();
                level.key = parsed.get<std::string>();
                if (!level.keys.insert(level.key).second) {
                    throw InputError(file_ + ":" + pointer(), "given twice", "keep one of the two");
                }
                break;
            }
            case json::parse_event_t::value:
                countElement();
                break;
        }
        return true;
    }

private:
    static constexpr std::size_t deepest = 64;

    struct Level {
        bool isArray = false;
        std::size_t count = 0;
        std::string key;
        std::set<std::string> keys;
    };

    void countElement() {
        if (!open_.empty()) {
            ++open_.back().count;
        }
    }

    std::string pointer() const {
        std::string text;
        for (const Level& level : open_) {
            text += "/" + (level.isArray ? std::to_string(level.count - 1) : escaped(level.key));
        }
        return text;
    }

    const std::string& file_;
    std::vector<Level> open_;
};

[[noreturn]] void failSyntax(const std::string& text, std::size_t byte, const std::string& name,
                             const std::string& what) {
    const std::size_t at = std::min(byte > 0 ? byte - 1 : 0, text.size());
    const std::size_t lineStart = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;  // npos + 1 is 0
    const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
    const std::size_t shownFrom = std::max(lineStart, at > 30 ? at - 30 : 0);
    const std::string near = text.substr(shownFrom, std::min(text.find('\n', at), at + 10) - shownFrom);
    throw InputError(name + ":" + std::to_string(line) + ":" + std::to_string(at - lineStart + 1),
                     at >= text.size() ? "end of file" : shown(json(near)), "not JSON: " + what);
}

}  // namespace

SceneFile read(const std::string& text, const std::string& name) {
    json root;
    try {
        // By reference: the parser copies its callback.
        ParseGuard guard(name);
        root = json::parse(
            text, [&guard](int depth, json::parse_event_t event, json& parsed) { return guard(depth, event, parsed); });
    } catch (const json::parse_error& error) {
        std::string what = error.what();
        const std::size_t from = what.find("syntax error");
        failSyntax(text, error.byte, name, from == std::string::npos ? what : what.substr(from));
    } catch (const json::out_of_range& error) {
        const std::string what = error.what();
        const std::size_t open = what.find('\'');
        const std::string number = open == std::string::npos ? "" : what.substr(open + 1, what.rfind('\'') - open - 1);
        failSyntax(text, text.find(number) + 1, name, "the number " + number + " is beyond what a double holds");
    }
    return readFile(root, name);
}

}  // namespace cairn::scene_file
