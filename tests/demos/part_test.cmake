# Configures demos/game with Cairn as a part of it, and with link-time optimisation: the game gets the libraries alone,
# which stay out of that, and nothing that it did not ask for is built, installed or looked for.
#   cmake -DSOURCE=<Cairn's source tree> -DWORK=<scratch folder> -DCXX=<compiler> -P part_test.cmake
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/demos/game -B ${WORK} -DCAIRN_SOURCE=${SOURCE}
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_INTERPROCEDURAL_OPTIMIZATION=ON
    RESULT_VARIABLE code OUTPUT_VARIABLE words ERROR_VARIABLE words)
if(NOT code EQUAL 0)
    message(FATAL_ERROR "the game with Cairn in it does not configure:\n${words}")
endif()

file(READ ${WORK}/compile_commands.json commands)
string(JSON count LENGTH "${commands}")
math(EXPR last "${count} - 1")
set(folders)
foreach(i RANGE ${last})
    string(JSON file GET "${commands}" ${i} file)
    string(JSON command GET "${commands}" ${i} command)
    if(command MATCHES " -flto" AND NOT command MATCHES " -flto.* -fno-lto")
        message(FATAL_ERROR "${file} is compiled for link-time optimisation, under which a game does not link")
    endif()
    if(command MATCHES " -Werror")
        message(FATAL_ERROR "${file}: a warning of the game's compiler would stop the game's build")
    endif()
    # What is made while it is built may lie anywhere, in Cairn's tree too.
    cmake_path(IS_PREFIX WORK "${file}" isMade)
    cmake_path(RELATIVE_PATH file BASE_DIRECTORY ${SOURCE} OUTPUT_VARIABLE place)
    if(NOT isMade AND place MATCHES "^([a-z]+)/")
        list(APPEND folders ${CMAKE_MATCH_1})
    endif()
endforeach()
list(REMOVE_DUPLICATES folders)
list(SORT folders)
if(NOT folders STREQUAL "base;collision;engine")
    message(FATAL_ERROR "a game that has Cairn in it builds base, collision and engine, not: ${folders}")
endif()

file(GLOB_RECURSE rules ${WORK}/cairn/cmake_install.cmake ${WORK}/cairn/*/cmake_install.cmake)
foreach(rule ${rules})
    file(READ ${rule} text)
    if(text MATCHES "file\\(INSTALL")
        message(FATAL_ERROR "${rule}: installing the game would install Cairn")
    endif()
endforeach()
