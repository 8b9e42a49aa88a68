# What a game may include is include/cairn/, as <cairn/...>; everything else is inside and is reached by its path from
# the root, "engine/world/world_impl.hpp".
add_library(cairn_warnings INTERFACE)
target_compile_options(cairn_warnings INTERFACE
    -Wall -Wextra -Wpedantic
    # Where files are compiled together, a local of one may be named as a constant of another.
    -Wshadow$<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:=local>
    -Wdouble-promotion -Wnon-virtual-dtor -Wold-style-cast -Wundef
    # GCC 12 sees vector loads past the end of small Eigen vectors in branches that are never taken.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
    # From a precompiled header its strings are no longer a system's, and GCC 12 sees them overflow.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow> $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
    -ffp-contract=off $<$<BOOL:${CAIRN_WERROR}>:-Werror>)
add_library(cairn_options INTERFACE)
target_link_libraries(cairn_options INTERFACE cairn_warnings)
target_include_directories(cairn_options INTERFACE ${PROJECT_SOURCE_DIR})
# Under g++'s link-time optimisation a file that lacks part of a class template refers to it weakly, and no file of an
# archive is taken for what is weak: a game that has it would not link. Cairn gains nothing by it (dolls, rain, pile:
# as fast to within 10 %), and is left out.
target_compile_options(cairn_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-fno-lto>)
if(CAIRN_SANITIZE)
    # GCC 12 takes what sanitizers add to std::regex for reads of what was never set.
    target_compile_options(cairn_options INTERFACE -fsanitize=${CAIRN_SANITIZE} -fno-omit-frame-pointer
        $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
    if(CAIRN_FUZZ)
        target_compile_options(cairn_options INTERFACE -fno-sanitize-recover=all)
    endif()
    target_link_options(cairn_options INTERFACE -fsanitize=${CAIRN_SANITIZE})
endif()

# cairn_module(NAME sources...): the library cairn_NAME of one folder, with warnings on.
function(cairn_module name)
    add_library(cairn_${name} ${ARGN})
    target_include_directories(cairn_${name} PUBLIC
        $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_link_libraries(cairn_${name} PRIVATE $<BUILD_INTERFACE:cairn_options>)
    target_compile_features(cairn_${name} PUBLIC cxx_std_20)
    cairn_precompile(cairn_${name} library)
    set_target_properties(cairn_${name} PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})
endfunction()
