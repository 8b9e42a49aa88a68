# The standard library and Eigen, compiled once for all libraries and once for all programs instead of in every file.
#   cairn_precompile(TARGET...)    the files of these targets start from it
# A precompiled header only serves files that are compiled as it was:
# - Libraries have -fPIC and programs -fPIE, so there are two. Definitions and warnings may differ.
# - g++ takes the optimisation level from it and says nothing: a file with an -O3 of its own would be compiled with -O2.
#   Such files are left out by SKIP_PRECOMPILE_HEADERS.
# - clang cannot read g++'s: clang-tidy works on a build folder with CMAKE_DISABLE_PRECOMPILE_HEADERS=ON, which also
#   finds files that do not include what they use.
# - ccache must be told not to mind what it cannot see: CCACHE_SLOPPINESS=pch_defines,time_macros (CMakeLists.txt).
set(CAIRN_PRECOMPILED
    <algorithm> <array> <cmath> <cstdint> <functional> <limits> <map> <memory> <optional> <span> <string>
    <variant> <vector> <Eigen/Core> <Eigen/Geometry>)

file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/library.cpp CONTENT "")
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/program.cpp CONTENT "int main() {}\n")
add_library(cairn_precompiled_library OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/precompiled/library.cpp)
add_executable(cairn_precompiled_program EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/precompiled/program.cpp)
foreach(owner cairn_precompiled_library cairn_precompiled_program)
    target_link_libraries(${owner} PRIVATE Eigen3::Eigen cairn_options)
    target_compile_features(${owner} PRIVATE cxx_std_20)
    target_precompile_headers(${owner} PRIVATE ${CAIRN_PRECOMPILED})
endforeach()

function(cairn_precompile)
    foreach(target ${ARGN})
        get_target_property(type ${target} TYPE)
        if(type STREQUAL EXECUTABLE)
            target_precompile_headers(${target} REUSE_FROM cairn_precompiled_program)
        else()
            target_precompile_headers(${target} REUSE_FROM cairn_precompiled_library)
        endif()
    endforeach()
endfunction()
