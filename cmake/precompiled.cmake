# The standard library, Eigen and what else every file of a target reads, compiled once instead of in every file.
#   cairn_precompile(TARGET KIND)    the files of this target start from the header of this kind
# Kinds are library and program, and of programs test, which has GoogleTest too, and command, which has CLI11 and JSON.
# A precompiled header only serves files that are compiled as it was:
# - Libraries have -fPIC and programs -fPIE, and a library's definitions, such as GoogleTest's, must be there when it is
#   made. Other definitions and warnings may differ.
# - g++ takes the optimisation level from it and says nothing: tests have a level of their own, and so has their header.
# - clang cannot read g++'s: clang-tidy works on a build folder with CMAKE_DISABLE_PRECOMPILE_HEADERS=ON, which also
#   finds files that do not include what they use.
# - ccache must be told not to mind what it cannot see: CCACHE_SLOPPINESS=pch_defines,time_macros (CMakeLists.txt).
set(CAIRN_PRECOMPILED
    <algorithm> <array> <cmath> <cstdint> <functional> <limits> <map> <memory> <optional> <span> <string>
    <variant> <vector> <Eigen/Core> <Eigen/Geometry>)
set(CAIRN_PRECOMPILED_test <gtest/gtest.h> LIBS GTest::gtest cairn_test_options)
set(CAIRN_PRECOMPILED_command <CLI/CLI.hpp> <nlohmann/json.hpp> LIBS CLI11::CLI11 nlohmann_json::nlohmann_json)

# What a target of this kind starts from. Made for its first user: by then what it needs is found.
function(cairn_precompiled kind)
    set(owner cairn_precompiled_${kind})
    if(TARGET ${owner})
        return()
    endif()
    cmake_parse_arguments(more "" "" "LIBS" ${CAIRN_PRECOMPILED_${kind}})
    set(source ${PROJECT_BINARY_DIR}/precompiled/${kind}.cpp)
    if(kind STREQUAL "library")
        file(CONFIGURE OUTPUT ${source} CONTENT "")
        add_library(${owner} OBJECT EXCLUDE_FROM_ALL ${source})
    else()
        file(CONFIGURE OUTPUT ${source} CONTENT "int main() {}\n")
        add_executable(${owner} EXCLUDE_FROM_ALL ${source})
    endif()
    target_link_libraries(${owner} PRIVATE Eigen3::Eigen ${more_LIBS} cairn_options)
    target_compile_features(${owner} PRIVATE cxx_std_20)
    target_precompile_headers(${owner} PRIVATE ${CAIRN_PRECOMPILED} ${more_UNPARSED_ARGUMENTS})
endfunction()

function(cairn_precompile target kind)
    cairn_precompiled(${kind})
    target_precompile_headers(${target} REUSE_FROM cairn_precompiled_${kind})
endfunction()

# Here, and not for its first user, so that it is the same header with and without a part of the tree.
cairn_precompiled(library)
