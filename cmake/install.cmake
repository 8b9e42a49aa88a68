# What is installed: the libraries with the headers that their doors reach, the command, the schema of scene files, and
# what find_package(cairn) and pkg-config need.
#   find_package(cairn)                             cairn::cairn (with cairn::collision and cairn::base under it)
#   find_package(cairn COMPONENTS assets render)    cairn::assets, cairn::render too
include(CMakePackageConfigHelpers)

set(CAIRN_COMPONENTS)
file(GLOB CAIRN_PUBLIC_HEADERS CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/include
    ${PROJECT_SOURCE_DIR}/include/cairn/*.hpp ${PROJECT_SOURCE_DIR}/include/cairn/joints/*.hpp)
foreach(component assets render)
    if(TARGET cairn_${component})
        list(APPEND CAIRN_COMPONENTS ${component})
        file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/include
            ${PROJECT_SOURCE_DIR}/include/cairn/${component}/*.hpp)
        list(APPEND CAIRN_PUBLIC_HEADERS ${headers})
    else()
        list(REMOVE_ITEM CAIRN_PUBLIC_HEADERS cairn/${component}.hpp)
    endif()
endforeach()

foreach(header ${CAIRN_PUBLIC_HEADERS})
    cmake_path(GET header PARENT_PATH folder)
    install(FILES include/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder})
endforeach()

# Each public header compiles alone, and twice, with nothing of the inside in reach, in a game without exceptions.
if(CAIRN_TESTS)
    set(sources)
    foreach(header ${CAIRN_PUBLIC_HEADERS})
        string(MAKE_C_IDENTIFIER ${header} name)
        set(source ${PROJECT_BINARY_DIR}/header_check/${name}.cpp)
        file(CONFIGURE OUTPUT ${source} CONTENT "#include <${header}>\n#include <${header}>\n")
        list(APPEND sources ${source})
    endforeach()
    add_library(cairn_header_check OBJECT ${sources})
    target_include_directories(cairn_header_check PRIVATE ${PROJECT_SOURCE_DIR}/include)
    target_link_libraries(cairn_header_check PRIVATE Eigen3::Eigen cairn_warnings)
    target_compile_options(cairn_header_check PRIVATE -O0 -g0 -fno-exceptions)
    if(CAIRN_UNITY)
        # Most of the time goes into reading Eigen. What only compiles with it, the other presets find.
        target_precompile_headers(cairn_header_check PRIVATE <Eigen/Core> <Eigen/Geometry>)
    endif()
endif()

install(TARGETS cairn_base cairn_collision cairn_engine EXPORT cairn)
set_target_properties(cairn_base PROPERTIES EXPORT_NAME base)
set_target_properties(cairn_collision PROPERTIES EXPORT_NAME collision)
set(CAIRN_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/cairn)
install(EXPORT cairn NAMESPACE cairn:: FILE cairnTargets.cmake DESTINATION ${CAIRN_PACKAGE_DIR})
foreach(component ${CAIRN_COMPONENTS})
    install(TARGETS cairn_${component} EXPORT cairn_${component})
    set_target_properties(cairn_${component} PROPERTIES EXPORT_NAME ${component})
    install(EXPORT cairn_${component} NAMESPACE cairn:: FILE cairn-${component}.cmake DESTINATION ${CAIRN_PACKAGE_DIR})
endforeach()

if(TARGET cairn_command)
    install(TARGETS cairn_command)
    install(FILES assets/data/stairs.stl assets/data/bowl.obj assets/data/hills.csv
        DESTINATION ${CMAKE_INSTALL_DATADIR}/cairn)
    if(BUILD_SHARED_LIBS)
        # What only the command links.
        install(TARGETS cairn_scenes cairn_demo cairn_studies)
        file(RELATIVE_PATH libraries /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})
        set_target_properties(cairn_command PROPERTIES INSTALL_RPATH "$ORIGIN/${libraries}")
    endif()
endif()
if(BUILD_SHARED_LIBS)
    foreach(library base collision engine assets render scenes demo studies)
        if(TARGET cairn_${library})
            set_target_properties(cairn_${library} PROPERTIES INSTALL_RPATH "$ORIGIN")
        endif()
    endforeach()
endif()
install(FILES docs/scene.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/cairn)

configure_package_config_file(cmake/cairnConfig.cmake.in ${PROJECT_BINARY_DIR}/cairnConfig.cmake
    INSTALL_DESTINATION ${CAIRN_PACKAGE_DIR} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cairnConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/cairnConfig.cmake ${PROJECT_BINARY_DIR}/cairnConfigVersion.cmake
    DESTINATION ${CAIRN_PACKAGE_DIR})

# The prefix is found from where cairn.pc lies, so that `cmake --install --prefix` and a moved tree stay right.
set(CAIRN_PC_DIR ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH CAIRN_PC_TO_PREFIX /${CAIRN_PC_DIR} /)
string(REGEX REPLACE "/$" "" CAIRN_PC_TO_PREFIX "${CAIRN_PC_TO_PREFIX}")
set(CAIRN_PC_LIBS "-lcairn_engine -lcairn_collision -lcairn_base")
set(CAIRN_PC_LIBS_BELOW "-lfcl -lccd -ltbb -lhwy -lpthread")
if(BUILD_SHARED_LIBS)
    set(CAIRN_PC_LIBS_PRIVATE "${CAIRN_PC_LIBS_BELOW}")
else()
    string(APPEND CAIRN_PC_LIBS " ${CAIRN_PC_LIBS_BELOW}")
endif()
configure_file(cmake/cairn.pc.in ${PROJECT_BINARY_DIR}/cairn.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/cairn.pc DESTINATION ${CAIRN_PC_DIR})
install(FILES LICENSE NOTICE DESTINATION ${CMAKE_INSTALL_DOCDIR})
