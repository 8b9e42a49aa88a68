# Headers are reached as <cairn/...> from the source tree as they will be from the installed one: the build tree holds a
# folder cairn/ with one link for each module.
set(CAIRN_HEADER_ROOT ${PROJECT_BINARY_DIR}/include)
file(MAKE_DIRECTORY ${CAIRN_HEADER_ROOT}/cairn)
foreach(module base collision engine assets render demos)
    file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${module} ${CAIRN_HEADER_ROOT}/cairn/${module} SYMBOLIC)
endforeach()
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/engine/cairn.hpp ${CAIRN_HEADER_ROOT}/cairn/cairn.hpp SYMBOLIC)

add_library(cairn_options INTERFACE)
target_compile_options(cairn_options INTERFACE
    -Wall -Wextra -Wpedantic -Wshadow -Wdouble-promotion -Wnon-virtual-dtor -Wold-style-cast -Wundef
    # GCC 12 sees vector loads past the end of small Eigen vectors in branches that are never taken.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
    -ffp-contract=off $<$<BOOL:${CAIRN_WERROR}>:-Werror>)
if(CAIRN_SANITIZE)
    target_compile_options(cairn_options INTERFACE -fsanitize=${CAIRN_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(cairn_options INTERFACE -fsanitize=${CAIRN_SANITIZE})
endif()

# cairn_module(NAME sources...): the library cairn_NAME of one folder, with warnings on and headers as <cairn/...>.
function(cairn_module name)
    add_library(cairn_${name} ${ARGN})
    target_include_directories(cairn_${name} PUBLIC
        $<BUILD_INTERFACE:${CAIRN_HEADER_ROOT}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_link_libraries(cairn_${name} PRIVATE $<BUILD_INTERFACE:cairn_options>)
    target_compile_features(cairn_${name} PUBLIC cxx_std_20)
    set_target_properties(cairn_${name} PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})
endfunction()
