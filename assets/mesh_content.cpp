// Numbers in these files are little-endian, as this processor's are.
#include "assets/mesh_content.hpp"

#include <cairn/input_error.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

namespace cairn {

namespace {

using nlohmann::json;

struct Ending {
    const char* ending;
    MeshKind kind;
};

// assimp reads forty formats; these are the ones whose readers stood up to thousands of damaged files.
constexpr std::array<Ending, 4> endings = {
    {{".obj", MeshKind::Obj}, {".stl", MeshKind::Stl}, {".glb", MeshKind::Glb}, {".gltf", MeshKind::Gltf}}};

constexpr std::size_t glbHeader = 12;   // "glTF", version, length of the file
constexpr std::size_t chunkHeader = 8;  // length, kind
constexpr std::size_t stlHeader = 84;   // 80 bytes of text, count of triangles
constexpr std::size_t stlTriangle = 50;

std::uint32_t wordAt(const std::string& bytes, std::size_t at) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + at, sizeof word);
    return word;
}

// Why it is none; empty if it is.
std::string whyNoGlb(const std::string& bytes) {
    if (bytes.size() < glbHeader + chunkHeader || bytes.compare(0, 4, "glTF") != 0) {
        return "it does not begin as a .glb file does";
    }
    if (wordAt(bytes, 4) != 2) {
        return "it is of version " + std::to_string(wordAt(bytes, 4)) + " of glTF, not of version 2";
    }
    if (wordAt(bytes, 8) > bytes.size()) {
        return "it says that it has " + std::to_string(wordAt(bytes, 8)) + " bytes, and has " +
               std::to_string(bytes.size());
    }
    std::size_t at = glbHeader;
    while (at + chunkHeader <= bytes.size()) {
        if (wordAt(bytes, at) > bytes.size() - at - chunkHeader) {
            return "a part of it says that it has " + std::to_string(wordAt(bytes, at)) + " bytes, and " +
                   std::to_string(bytes.size() - at - chunkHeader) + " are left";
        }
        if (at == glbHeader && bytes.compare(at + 4, 4, "JSON") != 0) {
            return "its first part is not the JSON one";
        }
        at += chunkHeader + wordAt(bytes, at);
    }
    return {};
}

std::string whyNoStl(const std::string& bytes) {
    const std::size_t text = bytes.find_first_not_of(" \t\r\n");
    if (text != std::string::npos && bytes.compare(text, 5, "solid") == 0) {
        return {};
    }
    if (bytes.size() < stlHeader) {
        return "it does not begin with \"solid\", and is too short for a binary STL file";
    }
    const std::size_t promised = wordAt(bytes, stlHeader - 4);
    if (promised > (bytes.size() - stlHeader) / stlTriangle) {
        return "it does not begin with \"solid\", and as a binary STL file it says that it holds " +
               std::to_string(promised) + " triangles, for which it is too short";
    }
    return {};
}

std::string_view gltfText(MeshKind kind, const std::string& bytes) {
    const std::string_view all = bytes;
    return kind == MeshKind::Gltf ? all : all.substr(glbHeader + chunkHeader, wordAt(bytes, glbHeader));
}

json gltfDocument(std::string_view text) {
    constexpr int deepest = 64;  // assimp's own parser goes down by calling itself
    return json::parse(text, [](int depth, json::parse_event_t, json&) {
        if (depth > deepest) {
            throw std::length_error("it is nested too deep");
        }
        return true;
    });
}

// Of elements that are read, none is smaller than a byte: a count beyond that is filled with zeros until memory ends.
std::string whyNoDocument(std::string_view text) {
    try {
        const json document = gltfDocument(text);
        double bytes = 0;
        for (const json& buffer : document.value("buffers", json::array())) {
            bytes += buffer.value("byteLength", 0.0);
        }
        for (const json& accessor : document.value("accessors", json::array())) {
            const double count = accessor.value("count", 0.0);
            if (!(count >= 0 && count <= bytes)) {
                return "an accessor of it counts " + accessor.at("count").dump() + " elements, and its buffers have " +
                       json(bytes).dump() + " bytes";
            }
        }
        return {};
    } catch (const json::parse_error&) {
        return "its JSON is damaged";
    } catch (const std::exception& error) {
        return error.what();
    }
}

}  // namespace

MeshKind meshKind(const std::filesystem::path& file) {
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const auto* const found =
        std::find_if(endings.begin(), endings.end(), [&](const Ending& e) { return ending == e.ending; });
    if (found == endings.end()) {
        throw InputError(file.string(), ending.empty() ? "(no extension)" : ending,
                         "mesh files are read as obj, stl, glb or gltf only; save it as one of these");
    }
    return found->kind;
}

void requireContent(const std::filesystem::path& file, MeshKind kind, const std::string& bytes) {
    std::string why;
    switch (kind) {
        case MeshKind::Obj:
            why = bytes.find('\0') != std::string::npos ? "it is no text, as .obj files are" : "";
            break;
        case MeshKind::Stl:
            why = whyNoStl(bytes);
            break;
        case MeshKind::Glb:
            why = whyNoGlb(bytes);
            why = why.empty() ? whyNoDocument(gltfText(kind, bytes)) : why;
            break;
        case MeshKind::Gltf:
            why = whyNoDocument(bytes);
            break;
    }
    if (!why.empty()) {
        throw InputError(file.string(), "(not readable as a mesh)", why + "; save it anew");
    }
}

std::size_t promisedTriangles(MeshKind kind, const std::string& bytes) {
    if (kind != MeshKind::Glb && kind != MeshKind::Gltf) {
        return 0;
    }
    const json document = gltfDocument(gltfText(kind, bytes));
    std::size_t triangles = 0;
    for (const auto& mesh : document.at("meshes")) {
        for (const auto& primitive : mesh.at("primitives")) {
            constexpr int list = 4;
            constexpr int fan = 6;
            const int mode = primitive.value("mode", list);
            const auto& source =
                primitive.contains("indices") ? primitive.at("indices") : primitive.at("attributes").at("POSITION");
            const auto corners = document.at("accessors").at(source.get<std::size_t>()).at("count").get<std::size_t>();
            if (mode == list) {
                triangles += corners / 3;
            } else if (mode > list && mode <= fan && corners > 2) {  // strips and fans
                triangles += corners - 2;
            }
        }
    }
    return triangles;
}

}  // namespace cairn
