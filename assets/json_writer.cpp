// The archives that write: the structs of scene_file.hpp as JSON, and their table as a JSON Schema.
#include "assets/scene_file.hpp"

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

namespace cairn::scene_file {

namespace {

using json = nlohmann::ordered_json;  // fields in the table's order

json valueOf(double x) {
    return x;
}
json valueOf(const Height& x) {
    return std::isnan(x.value) ? json(nullptr) : json(x.value);
}
json valueOf(int x) {
    return x;
}
json valueOf(std::uint32_t x) {
    return x;
}
json valueOf(bool x) {
    return x;
}
json valueOf(const std::string& x) {
    return x;
}
template <Worded E>
json valueOf(E x) {
    return Words<E>::list[static_cast<std::size_t>(x)];
}
json valueOf(const BodyRef& x) {
    return x.index >= 0 ? json(x.index) : json(x.name);
}
json valueOf(const Vec3d& x) {
    return {x.x(), x.y(), x.z()};
}
json valueOf(const Quatd& x) {
    return {x.x(), x.y(), x.z(), x.w()};
}

template <class T, std::size_t N>
json valueOf(std::array<T, N>& list) {
    return json(list);
}
template <class T>
json valueOf(std::vector<T>& list);
template <class T>
json valueOf(std::optional<T>& value);
template <class T>
json valueOf(std::map<std::string, T>& map);
template <Record Struct>
json valueOf(Struct& value);

// Equal to the last bit: 0 and -0 differ.
bool same(const json& a, const json& b) {
    if (a.is_number_float() && b.is_number_float()) {
        return std::bit_cast<std::uint64_t>(a.get<double>()) == std::bit_cast<std::uint64_t>(b.get<double>());
    }
    if (a.is_array() && b.is_array()) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
    }
    return a == b;
}

void requireFinite(const std::string& name, const json& value) {
    if (value.is_number_float() && !std::isfinite(value.get<double>())) {
        throw InputError(name, std::to_string(value.get<double>()),
                         "give a finite number; a scene file holds no other");
    }
    if (value.is_array()) {
        for (const json& element : value) {
            requireFinite(name, element);
        }
    }
}

class ObjectWriter {
public:
    template <class T>
    void field(const char* name, T& value, const Rule& rule) {
        all_[name] = valueOf(value);
        if (rule.required) {
            required_.push_back(name);
        }
    }
    template <class Variant>
    void kind(const char* name, Variant& def, const KindRule& rule) {
        all_[name] = kindName(def);
        if (rule.required || def.index() > 0) {
            required_.push_back(name);
        }
    }
    void oneOf(std::initializer_list<const char*>) {}
    void together(const char*, const char*) {}

    const json& all() const { return all_; }

    // The fields that are required or that differ from `defaults`.
    json without(const ObjectWriter& defaults) const {
        json out = json::object();
        for (const auto& [name, value] : all_.items()) {
            const bool required = std::find(required_.begin(), required_.end(), name) != required_.end();
            if (required || !same(value, defaults.all_.at(name))) {
                requireFinite(name, value);
                out[name] = value;
            }
        }
        return out;
    }

private:
    json all_ = json::object();
    std::vector<std::string> required_;
};

template <class Struct>
Struct blankLike(const Struct&) {
    return {};
}
JointFields blankLike(const JointFields& joint) {
    return {.def = makeKind<JointDef>(joint.def.index())};
}
SolverDef blankLike(const SolverDef& def) {
    return makeKind<SolverDef>(def.index());
}

template <class T>
json valueOf(std::vector<T>& list) {
    json out = json::array();
    for (T& element : list) {
        out.push_back(valueOf(element));
    }
    return out;
}

template <class T>
json valueOf(std::optional<T>& value) {
    return value ? valueOf(*value) : json();
}

template <class T>
json valueOf(std::map<std::string, T>& map) {
    json out = json::object();
    for (auto& [name, element] : map) {
        out[name] = valueOf(element);
    }
    return out;
}

template <Record Struct>
json valueOf(Struct& value) {
    Struct blank = blankLike(value);
    ObjectWriter mine;
    ObjectWriter defaults;
    describe(mine, value);
    describe(defaults, blank);
    return mine.without(defaults);
}

void printOnOneLine(const json& value, std::string& out) {
    if (!value.is_structured() || value.empty()) {
        out += value.dump();
        return;
    }
    out += value.is_object() ? "{ " : "[";
    for (auto it = value.begin(); it != value.end(); ++it) {
        out += it == value.begin() ? "" : ", ";
        if (value.is_object()) {
            out += json(it.key()).dump();
            out += ": ";
        }
        printOnOneLine(*it, out);
    }
    out += value.is_object() ? " }" : "]";
}

// As a person would set it: what fits in a line stands in a line.
void print(const json& value, std::size_t indent, std::size_t used, std::string& out) {
    constexpr std::size_t width = 120;
    constexpr std::size_t step = 2;
    std::string line;
    printOnOneLine(value, line);
    if (!value.is_structured() || used + line.size() < width) {
        out += line;
        return;
    }
    out += value.is_object() ? "{" : "[";
    for (auto it = value.begin(); it != value.end(); ++it) {
        out += it == value.begin() ? "\n" : ",\n";
        out.append(indent + step, ' ');
        const std::size_t start = out.size();
        if (value.is_object()) {
            out += json(it.key()).dump();
            out += ": ";
        }
        print(*it, indent + step, indent + step + out.size() - start, out);
    }
    out += "\n";
    out.append(indent, ' ');
    out += value.is_object() ? "}" : "]";
}

std::string printed(const json& value) {
    std::string out;
    print(value, 0, 0, out);
    return out + "\n";
}

json numberSchema(const char* type, const Rule& rule) {
    json out = {{"type", type}};
    if (std::isfinite(rule.min)) {
        out[rule.above ? "exclusiveMinimum" : "minimum"] = rule.min;
    }
    if (std::isfinite(rule.max)) {
        out[rule.below ? "exclusiveMaximum" : "maximum"] = rule.max;
    }
    return out;
}

json listSchema(const json& items, std::size_t minItems, std::size_t maxItems = SIZE_MAX) {
    json out = {{"type", "array"}, {"items", items}};
    if (minItems > 0) {
        out["minItems"] = minItems;
    }
    if (maxItems != SIZE_MAX) {
        out["maxItems"] = maxItems;
    }
    return out;
}

class SchemaWriter {
public:
    template <class T>
    void field(const char* name, T& value, const Rule& rule) {
        json entry = schemaOf(value, rule);
        entry["description"] = rule.text;
        const json standard = valueOf(value);
        const bool inRange =
            !standard.is_number() || (standard.get<double>() >= rule.min && std::isfinite(standard.get<double>()));
        if (!rule.required && inRange && !standard.is_null() && !standard.empty() && standard != "") {
            entry["default"] = standard;
        }
        properties_[name] = entry;
        if (rule.required) {
            required_.push_back(name);
        }
    }
    template <class Variant>
    void kind(const char* name, Variant& def, const KindRule& rule) {
        properties_[name] = {{"const", kindName(def)}};
        if (rule.required || def.index() > 0) {
            required_.push_back(name);
        }
    }
    void oneOf(std::initializer_list<const char*> names) {
        for (const char* name : names) {
            oneOf_.push_back({{"required", json::array({name})}});
        }
    }
    void together(const char* first, const char* second) {
        dependent_[first] = json::array({second});
        dependent_[second] = json::array({first});
    }

    json object() const {
        json out = {{"type", "object"}, {"properties", properties_}, {"additionalProperties", false}};
        if (!required_.empty()) {
            out["required"] = required_;
        }
        if (!oneOf_.empty()) {
            out["oneOf"] = oneOf_;
        }
        if (!dependent_.empty()) {
            out["dependentRequired"] = dependent_;
        }
        return out;
    }

    static json schemaOf(double, const Rule& rule) { return numberSchema("number", rule); }
    static json schemaOf(const Height&, const Rule&) { return {{"type", {"number", "null"}}}; }
    static json schemaOf(int, const Rule& rule) { return numberSchema("integer", rule); }
    static json schemaOf(std::uint32_t, const Rule& rule) { return numberSchema("integer", rule); }
    static json schemaOf(bool, const Rule&) { return {{"type", "boolean"}}; }
    static json schemaOf(const std::string&, const Rule&) { return {{"type", "string"}}; }
    template <Worded E>
    static json schemaOf(E, const Rule&) {
        return {{"enum", Words<E>::list}};
    }
    static json schemaOf(const BodyRef&, const Rule&) { return {{"type", {"string", "integer"}}, {"minimum", 0}}; }
    static json schemaOf(const Vec3d&, const Rule& rule) { return listSchema(numberSchema("number", rule), 3, 3); }
    static json schemaOf(const Quatd&, const Rule& rule) { return listSchema(numberSchema("number", rule), 4, 4); }
    template <class T, std::size_t N>
    static json schemaOf(std::array<T, N>&, const Rule& rule) {
        return listSchema(schemaOf(T{}, rule), N, N);
    }
    template <class T>
    static json schemaOf(std::vector<T>&, const Rule& rule) {
        T element{};
        Rule ofElements = rule;
        ofElements.minItems = 0;
        return listSchema(schemaOf(element, ofElements), rule.minItems);
    }
    template <class T>
    static json schemaOf(std::optional<T>&, const Rule& rule) {
        T value{};
        return schemaOf(value, rule);
    }
    template <class T>
    static json schemaOf(std::map<std::string, T>&, const Rule& rule) {
        T element{};
        return {{"type", "object"}, {"additionalProperties", schemaOf(element, rule)}};
    }
    static json schemaOf(JointFields&, const Rule&) {
        return schemaOfKinds<JointDef>([](const JointDef& def) { return JointFields{.def = def}; });
    }
    static json schemaOf(SolverDef&, const Rule&) {
        return schemaOfKinds<SolverDef>([](const SolverDef& def) { return def; });
    }
    template <Record Struct>
    static json schemaOf(Struct& value, const Rule&) {
        return objectSchema(value);
    }

private:
    template <class Variant>
    static json schemaOfKinds(const auto& structWith) {
        json kinds = json::array();
        for (std::size_t i = 0; i < std::variant_size_v<Variant>; ++i) {
            auto value = structWith(makeKind<Variant>(i));
            kinds.push_back(objectSchema(value));
        }
        return {{"oneOf", kinds}};
    }

    template <class Struct>
    static json objectSchema(Struct& value) {
        SchemaWriter writer;
        describe(writer, value);
        return writer.object();
    }

    json properties_ = json::object();
    json required_ = json::array();
    json oneOf_ = json::array();
    json dependent_ = json::object();
};

json schemaJson() {
    SceneFile file;
    json out = {
        {"$schema", "https://json-schema.org/draft/2020-12/schema"},
        {"title", "Cairn scene"},
        {"description",
         "m, kg, s, rad; y is up by default. Unknown fields are errors. Names of bodies and joints are unique."}};
    out.update(SchemaWriter::schemaOf(file, {""}));
    return out;
}

// The manual's tables, from the schema: a section for each object, with a row for each of its fields.
class FieldsPage {
public:
    std::string text(const json& schema) {
        object("the file", "", schema);
        return out_;
    }

private:
    static std::string limits(const json& schema) {
        std::string out;
        for (const auto& [keyword, words] : {std::pair{"minimum", "at least"},
                                             {"exclusiveMinimum", "above"},
                                             {"maximum", "at most"},
                                             {"exclusiveMaximum", "below"}}) {
            if (schema.contains(keyword)) {
                out += std::string(out.empty() ? " " : ", ") + words + " " + numberText(schema[keyword].get<double>());
            }
        }
        return out;
    }

    static std::string kind(const json& schema) {
        if (schema.contains("enum")) {
            std::string words;
            for (const json& word : schema["enum"]) {
                words += (words.empty() ? "`" : ", `") + word.get<std::string>() + "`";
            }
            return words;
        }
        if (schema.contains("const")) {
            return "`" + schema["const"].get<std::string>() + "`";
        }
        if (schema.contains("oneOf") || !schema.contains("type")) {
            return "object";
        }
        if (schema["type"].is_array()) {
            std::string words;
            for (const json& type : schema["type"]) {
                words += (words.empty() ? "" : " or ") + type.get<std::string>();
            }
            return words;
        }
        if (schema["type"] == "array") {
            const bool fixed = schema.contains("maxItems");
            const std::string count = fixed ? std::to_string(schema["maxItems"].get<int>()) + " of: "
                                      : schema.contains("minItems")
                                          ? "at least " + std::to_string(schema["minItems"].get<int>()) + " of: "
                                          : "list of: ";
            return count + kind(schema["items"]);
        }
        return schema["type"].get<std::string>() + limits(schema);
    }

    // What a field's value is made of, if of objects.
    static const json* inside(const json& schema, std::string& path) {
        if (schema.contains("properties") || schema.contains("oneOf")) {
            return &schema;
        }
        if (schema.contains("items")) {
            path += "[]";
            return inside(schema["items"], path);
        }
        if (schema.contains("additionalProperties") && schema["additionalProperties"].is_object()) {
            path += ".NAME";
            return inside(schema["additionalProperties"], path);
        }
        return nullptr;
    }

    void object(const std::string& title, const std::string& path, const json& schema) {
        // The same object in several places is told once.
        const auto [told, isNew] =
            told_.emplace(schema.contains("properties") ? schema["properties"].dump() : "", title);
        if (schema.contains("properties") && !isNew) {
            out_ += "\n## " + title + "\n\nAs " + told->second + ".\n";
            return;
        }
        if (!schema.contains("properties")) {  // one of several kinds
            for (const json& option : schema["oneOf"]) {
                object("`" + path + "`, type `" + option["properties"]["type"]["const"].get<std::string>() + "`", path,
                       option);
            }
            return;
        }
        out_ += "\n## " + title + "\n\n";
        if (schema.contains("oneOf")) {
            out_ += "Exactly one of";
            for (const json& option : schema["oneOf"]) {
                out_ += (&option == &schema["oneOf"].front() ? " `" : ", `") +
                        option["required"][0].get<std::string>() + "`";
            }
            out_ += ".\n\n";
        }
        out_ += "| field | value | default | meaning |\n|---|---|---|---|\n";
        const json required = schema.value("required", json::array());
        for (const auto& [name, field] : schema["properties"].items()) {
            const bool must = std::find(required.begin(), required.end(), name) != required.end();
            out_ += "| `" + name + "` | " + kind(field) + " | " +
                    (must                        ? "required"
                     : field.contains("default") ? "`" + field["default"].dump() + "`"
                                                 : "") +
                    " | " + field.value("description", "which") + " |\n";
        }
        for (const auto& [name, field] : schema["properties"].items()) {
            std::string inner = path;
            inner += path.empty() ? "" : ".";
            inner += name;
            if (const json* const parts = inside(field, inner)) {
                object("`" + inner + "`", inner, *parts);
            }
        }
    }

    std::string out_;
    std::map<std::string, std::string> told_;
};

// For readers: what a field means does not depend on whose it is, and so is told once.
json schemaWithSolversAsOne() {
    SolverNumbers numbers;
    const json fields = SchemaWriter::schemaOf(numbers, {""})["properties"];
    json out = schemaJson();
    json& solver = out["properties"]["world"]["properties"]["solver"];
    const json text = solver["description"];
    solver = {{"type", "object"}, {"description", text}};
    solver["properties"]["name"] = {{"enum", kindNames<SolverDef>},
                                    {"default", solverName({})},
                                    {"description", "which solver; auto picks one for each island"}};
    solver["properties"].update(fields);
    return out;
}

std::string solversTable() {
    std::string out = "| field |";
    std::string line = "|---|";
    for (const SolverInfo& info : solverList()) {
        out += " " + std::string(info.name) + " |";
        line += "---|";
    }
    out += "\n" + line + "\n";
    SolverNumbers numbers;
    ObjectWriter fields;
    describe(fields, numbers);
    for (const auto& [name, value] : fields.all().items()) {
        out += "| `" + name + "` |";
        for (const SolverInfo& info : solverList()) {
            out += info.takes(name) ? " x |" : "  |";
        }
        out += "\n";
    }
    return out;
}

}  // namespace

std::string write(SceneFile& file) {
    try {
        return printed(valueOf(file));
    } catch (const json::type_error& error) {
        throw InputError("name or description", "(not UTF-8)", error.what());
    }
}

std::string schema() {
    return printed(schemaJson());
}

std::string fieldsPage() {
    return "# Fields\n\n"
           "Every field of a scene file, and with the same names of the structs that a game fills in (`WorldDef`, "
           "`SolverDef`, `BodyDef`, joints, deformables): what it may be, what it is when left out, and what it means. "
           "Made from the table by which the engine checks them all; a number beyond its limits, one that is not "
           "finite "
           "and a field that is not listed are refused with place, value and remedy. Units: m, kg, s, rad.\n"
           "\n## Which solver takes what\n\n"
           "In C++ each solver is a struct of these fields alone (`<cairn/solvers.hpp>`). A file that gives it others "
           "is refused, and told who takes them.\n\n" +
           solversTable() + FieldsPage().text(schemaWithSolversAsOne());
}

}  // namespace cairn::scene_file
