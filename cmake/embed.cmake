# Text in files of its own, such as the scripts and styles of pages, becomes part of a library when that is built.
#   cairn_embed(TARGET HEADER NAME=FILE...)
# HEADER and the FILEs lie beside the CMakeLists.txt that calls. HEADER, say view_text.hpp, declares each
# `extern const std::string_view NAME;` in namespace cairn::view_text. A FILE opens with a comment that says what it is,
# which is for its readers and no part of the text.
# This file is its own script too: cmake -DFILE= -DHEADER= -DNAME= -DOUTPUT= -P embed.cmake
if(NOT CMAKE_SCRIPT_MODE_FILE)
    function(cairn_embed target header)
        set(script ${CMAKE_CURRENT_FUNCTION_LIST_FILE})
        cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE folder)
        cmake_path(GET header STEM namespace)
        foreach(text ${ARGN})
            string(REGEX REPLACE "=.*" "" name ${text})
            string(REGEX REPLACE ".*=" "" file ${text})
            set(output ${CMAKE_CURRENT_BINARY_DIR}/embedded/${file}.cpp)
            add_custom_command(OUTPUT ${output}
                COMMAND ${CMAKE_COMMAND} -DFILE=${CMAKE_CURRENT_SOURCE_DIR}/${file} -DHEADER=${folder}/${header}
                    -DNAME=cairn::${namespace}::${name} -DOUTPUT=${output} -P ${script}
                DEPENDS ${file} ${script} COMMENT "Embedding ${folder}/${file}" VERBATIM)
            set_source_files_properties(${output} PROPERTIES SKIP_PRECOMPILE_HEADERS ON
                SKIP_UNITY_BUILD_INCLUSION ON)
            target_sources(${target} PRIVATE ${output})
        endforeach()
    endfunction()
    return()
endif()

file(READ "${FILE}" text)
if(NOT text MATCHES "^((//[^\n]*\n)+|/\\*[^*]*\\*/[^\n]*\n|<!--[^>]*-->[^\n]*\n)")
    message(FATAL_ERROR "${FILE} does not open with a comment: say there what it is")
endif()
string(LENGTH "${CMAKE_MATCH_0}" comment)
file(READ "${FILE}" bytes OFFSET ${comment} HEX)
# One by one: compilers limit how long a string literal may be.
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${bytes}")
string(REPEAT "'[^']*'," 16 line)
string(REGEX REPLACE "(${line})" "\\1\n" bytes "${bytes}")
cmake_path(GET FILE FILENAME file)
file(WRITE "${OUTPUT}" "// Made from ${file} by cmake/embed.cmake.
#include \"${HEADER}\"

static constexpr char bytes[] = {
${bytes}
};
constinit const std::string_view ${NAME}{bytes, sizeof bytes};
")
