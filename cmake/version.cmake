# CAIRN_VERSION, read from the header that has the numbers, for project(VERSION). Include it before project().
set(CAIRN_VERSION_HEADER ${CMAKE_CURRENT_LIST_DIR}/../include/cairn/version.hpp)
file(STRINGS ${CAIRN_VERSION_HEADER} cairn_version_lines REGEX "^#define CAIRN_VERSION_(MAJOR|MINOR|PATCH) [0-9]+$")
foreach(part MAJOR MINOR PATCH)
    if(NOT "${cairn_version_lines}" MATCHES "CAIRN_VERSION_${part} ([0-9]+)")
        message(FATAL_ERROR "include/cairn/version.hpp has no line '#define CAIRN_VERSION_${part} NUMBER'")
    endif()
    set(CAIRN_VERSION_${part} ${CMAKE_MATCH_1})
endforeach()
set(CAIRN_VERSION ${CAIRN_VERSION_MAJOR}.${CAIRN_VERSION_MINOR}.${CAIRN_VERSION_PATCH})
# A changed header configures anew.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CAIRN_VERSION_HEADER})
