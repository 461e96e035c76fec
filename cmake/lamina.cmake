# The one place where flags are set. In short:
#
#   lamina_find_dependency(OpenCV 4 REQUIRED COMPONENTS core imgproc)   find_package, and remembered
#   lamina_pkg_dependency(OPENNI2 libopenni2)                           pkg-config: PkgConfig::OPENNI2
#   lamina_add_library(NAME SOURCES ... PUBLIC ... PRIVATE ... SYSTEM ...)
#   lamina_add_test(NAME SOURCES ... LINK ...)      lamina_add_app(NAME SOURCES ... LINK ...)
#   lamina_add_test_support(NAME SOURCES ... LINK ...)      shared by tests: tests/support
#
# Our libraries are static: whoever links the installed lamina::sensors links OpenCV too, even where
# it is PRIVATE here. So a folder finds third-party packages with lamina_find_dependency or
# lamina_pkg_dependency instead of find_package and pkg_check_modules, before its
# lamina_add_library: the installed lamina-config.cmake then finds the same for that library.
# (Libraries given by full path, as find_library returns them, need nothing: the path is exported.
# A Find<Name>.cmake in cmake/ is installed beside the config file and used by it.)
include(GNUInstallDirs)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
# Dev: optimised enough for tests to be quick, NDEBUG off so that assertions hold, short debug info.
set(CMAKE_CXX_FLAGS_DEV "-O2 -g1" CACHE STRING "" FORCE)
set(CMAKE_EXE_LINKER_FLAGS_DEV "" CACHE STRING "" FORCE)
set(CMAKE_SHARED_LINKER_FLAGS_DEV "" CACHE STRING "" FORCE)

find_program(LAMINA_CCACHE ccache)
mark_as_advanced(LAMINA_CCACHE)
if(LAMINA_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${LAMINA_CCACHE})
endif()

# Headers are included as <lamina/FOLDER/NAME.hpp>, in the tree as after installation.
function(lamina_include_tree)
  set(tree ${CMAKE_BINARY_DIR}/include/lamina)
  if(IS_SYMLINK ${tree})  # of an earlier version
    file(REMOVE ${tree})
  endif()
  file(MAKE_DIRECTORY ${tree})
  foreach(folder IN LISTS LAMINA_FOLDERS ITEMS apps)
    file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${folder} ${tree}/${folder} SYMBOLIC)
  endforeach()
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/pipeline/config/lamina.hpp ${tree}/lamina.hpp SYMBOLIC)
  configure_file(${CMAKE_SOURCE_DIR}/cmake/version.hpp.in ${tree}/version.hpp @ONLY)
endfunction()

# Eigen and the standard containers are parsed once: 2 s less for every file; tests have GMock too.
function(lamina_precompiled_header)
  add_library(lamina_pch STATIC ${CMAKE_SOURCE_DIR}/cmake/pch.cpp)
  set(headers <Eigen/Core> <Eigen/Geometry> <algorithm> <cmath> <cstdint> <functional> <map> <memory>
              <optional> <set> <span> <string> <unordered_map> <variant> <vector>)
  target_precompile_headers(lamina_pch PRIVATE ${headers})
  if(LAMINA_BUILD_TESTS)
    add_library(lamina_test_pch STATIC ${CMAKE_SOURCE_DIR}/cmake/pch.cpp)
    target_precompile_headers(lamina_test_pch PRIVATE ${headers} <gmock/gmock.h>)
    target_link_libraries(lamina_test_pch PRIVATE GTest::gmock)
  endif()
  foreach(target lamina_pch lamina_test_pch)
    if(TARGET ${target})
      target_link_libraries(${target} PRIVATE Eigen3::Eigen)
      lamina_set_flags(${target})
    endif()
  endforeach()
endfunction()

# Flags of one target, and the precompiled header it shares (lamina_pch when none is named).
function(lamina_set_flags target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  # One code model for libraries and programs alike, so that they share the precompiled header.
  target_compile_options(${target} PRIVATE -fPIC)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wold-style-cast)
  # The same bytes on every x86-64: no fused multiply-add contraction across machines.
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  set(header ${ARGN} lamina_pch)
  list(GET header 0 header)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -fpch-preprocess)  # what ccache asks for
    if(NOT target MATCHES "_pch$")
      target_precompile_headers(${target} REUSE_FROM ${header})
    endif()
  endif()
  if(LAMINA_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(LAMINA_EIGEN_NAN)
    target_compile_definitions(${target} PRIVATE EIGEN_INITIALIZE_MATRICES_BY_NAN)
  endif()
  if(LAMINA_SANITIZE)
    # -O1, and without the four checks that GCC writes at every access: a third of the compile time
    # (39.8 to 20.3 s for sliding_window.cpp at -O1, 70.9 at -O2). The fuzz targets have them.
    target_compile_options(${target} PRIVATE -O1 -fsanitize=${LAMINA_SANITIZE} -fno-omit-frame-pointer
                                             -fno-sanitize=null,alignment,object-size,vptr
                                             -fno-sanitize-recover=all)
    # Eigen frees by other rules under the address sanitizer than the libraries of the distribution
    # allocate (ceres, pcl): malloc is aligned to 16 bytes there, too.
    target_compile_definitions(${target} PRIVATE EIGEN_MALLOC_ALREADY_ALIGNED=1)
    target_link_options(${target} PUBLIC -fsanitize=${LAMINA_SANITIZE})
  endif()
endfunction()

# find_package(ARGN...), remembered for the libraries of this folder. Without REQUIRED a package that
# is not there is not remembered either. A macro, because find_package sets variables here.
macro(lamina_find_dependency package)
  find_package(${package} ${ARGN})
  if(${package}_FOUND)
    set(_lamina_arguments ${package} ${ARGN})
    list(REMOVE_ITEM _lamina_arguments REQUIRED QUIET)  # find_dependency hands these on itself
    lamina_remember_dependency("find_dependency(${_lamina_arguments})")
  endif()
endmacro()

# pkg_check_modules(PREFIX REQUIRED IMPORTED_TARGET modules...), remembered: link PkgConfig::PREFIX.
# With OPTIONAL as first module PREFIX_FOUND says whether it is there.
macro(lamina_pkg_dependency prefix)
  find_package(PkgConfig REQUIRED)
  set(_lamina_modules ${ARGN})
  if("OPTIONAL" IN_LIST _lamina_modules)
    list(REMOVE_ITEM _lamina_modules OPTIONAL)
    pkg_check_modules(${prefix} QUIET IMPORTED_TARGET ${_lamina_modules})
  else()
    pkg_check_modules(${prefix} REQUIRED IMPORTED_TARGET ${_lamina_modules})
  endif()
  if(${prefix}_FOUND)
    lamina_remember_dependency("find_dependency(PkgConfig)")
    lamina_remember_dependency(
      "pkg_check_modules(${prefix} REQUIRED QUIET IMPORTED_TARGET ${_lamina_modules})")
  endif()
endmacro()

# lamina_sources(OUT FOLDER...): the .cpp files of the folders (relative to this one), rooms included
# only where they are named. A file that is added or removed is noticed by the next build.
function(lamina_sources out)
  set(found)
  foreach(folder IN LISTS ARGN)
    file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp)
    list(APPEND found ${files})
  endforeach()
  set(${out} ${found} PARENT_SCOPE)
endfunction()

function(lamina_remember_dependency call)
  string(REPLACE ";" " " call "${call}")
  set_property(DIRECTORY APPEND PROPERTY LAMINA_DEPENDENCIES "${call}")
endfunction()

# lamina_add_library(NAME SOURCES... PUBLIC targets... PRIVATE targets... [SYSTEM includes...])
# makes the static library lamina_NAME, alias lamina::NAME, installed and exported.
function(lamina_add_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE;SYSTEM" ${ARGN})
  set(target lamina_${name})
  add_library(${target} STATIC ${ARG_SOURCES})
  add_library(lamina::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  lamina_set_flags(${target})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${CMAKE_BINARY_DIR}/include>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_include_directories(${target} SYSTEM PRIVATE ${ARG_SYSTEM})
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  get_property(dependencies DIRECTORY PROPERTY LAMINA_DEPENDENCIES)
  set_property(GLOBAL PROPERTY LAMINA_DEPENDENCIES_${name} "${dependencies}")
  set(linked ${ARG_PUBLIC} ${ARG_PRIVATE})
  list(FILTER linked INCLUDE REGEX "^lamina::")
  list(TRANSFORM linked REPLACE "^lamina::" "")
  set_property(GLOBAL PROPERTY LAMINA_LINKED_${name} "${linked}")
  set_property(GLOBAL APPEND PROPERTY LAMINA_LIBRARIES ${name})
endfunction()

# lamina_add_test(NAME SOURCES... LINK targets... [LABELS ...] [WHOLE SUITES...]) makes NAME_test and lists in
# ctest each of its suites (label unit) or each TEST (others). Suites that solve whole maps or read whole
# recordings are named behind WHOLE: they have the label e2e.
function(lamina_add_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;LINK;LABELS;WHOLE" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  if(LAMINA_SANITIZE)
    math(EXPR ARG_TIMEOUT "10 * ${ARG_TIMEOUT}")
  endif()
  add_executable(${name}_test ${ARG_SOURCES})
  lamina_set_flags(${name}_test lamina_test_pch)
  target_link_libraries(${name}_test PRIVATE ${ARG_LINK} GTest::gmock_main)
  target_compile_definitions(${name}_test PRIVATE LAMINA_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
                                                  LAMINA_BINARY_DIR="${CMAKE_BINARY_DIR}")
  if(ARG_LABELS STREQUAL unit)
    set(LAMINA_TEST_PROGRAM ${CMAKE_CURRENT_BINARY_DIR}/${name}_test)
    set(suites ${CMAKE_CURRENT_BINARY_DIR}/${name}_suites.cmake)
    configure_file(${CMAKE_SOURCE_DIR}/cmake/add_suites.cmake.in ${suites} @ONLY)
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${suites})
  else()
    gtest_discover_tests(${name}_test DISCOVERY_MODE PRE_TEST
                         PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}")
  endif()
endfunction()

# lamina_add_test_support(NAME SOURCES... LINK targets...) makes the static library lamina_NAME for
# tests, not installed; its headers are included as "support/NAME.hpp".
function(lamina_add_test_support name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_library(lamina_${name} STATIC ${ARG_SOURCES})
  lamina_set_flags(lamina_${name} lamina_test_pch)
  target_include_directories(lamina_${name} PUBLIC ${CMAKE_SOURCE_DIR}/tests)
  target_link_libraries(lamina_${name} PUBLIC ${ARG_LINK})
endfunction()

# lamina_add_app(NAME SOURCES... LINK targets...) makes an installed program in the build folder itself.
function(lamina_add_app name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  lamina_set_flags(${name})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}
                                           OUTPUT_NAME ${name})
  target_link_libraries(${name} PRIVATE ${ARG_LINK})
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endfunction()

# What lamina-config.cmake has to find for each library, as CMake code: LAMINA_CONFIG_DEPENDENCIES.
# Libraries were added bottom to top, so what a library links is complete when it is reached.
function(lamina_config_dependencies)
  get_property(libraries GLOBAL PROPERTY LAMINA_LIBRARIES)
  list(JOIN libraries " " text)
  set(text "set(lamina_LIBRARIES ${text})\n")
  foreach(name IN LISTS libraries)
    get_property(linked GLOBAL PROPERTY LAMINA_LINKED_${name})
    set(needs_${name} ${name})
    foreach(other IN LISTS linked)
      list(APPEND needs_${name} ${needs_${other}})
    endforeach()
    list(REMOVE_DUPLICATES needs_${name})
  endforeach()
  foreach(name IN LISTS libraries)
    get_property(calls GLOBAL PROPERTY LAMINA_DEPENDENCIES_${name})
    list(REMOVE_DUPLICATES calls)
    set(wanted_by "")
    foreach(other IN LISTS libraries)
      if(name IN_LIST needs_${other})
        list(APPEND wanted_by ${other})
      endif()
    endforeach()
    if(calls)
      list(JOIN calls "\n  " body)
      list(JOIN wanted_by "|" pattern)
      string(APPEND text "if(NOT lamina_FIND_COMPONENTS OR lamina_FIND_COMPONENTS MATCHES "
                         "\"(^|;)(${pattern})(;|$)\")\n  ${body}\nendif()\n")
    endif()
  endforeach()
  set(LAMINA_CONFIG_DEPENDENCIES "${text}" PARENT_SCOPE)
endfunction()

# Headers, libraries, and lamina-config.cmake, so that others say find_package(lamina).
function(lamina_install)
  include(CMakePackageConfigHelpers)
  get_property(libraries GLOBAL PROPERTY LAMINA_LIBRARIES)
  list(TRANSFORM libraries PREPEND lamina_ OUTPUT_VARIABLE targets)
  install(TARGETS ${targets} EXPORT lamina-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  # What only the library's own files include stays here.
  foreach(folder IN LISTS LAMINA_FOLDERS)
    install(DIRECTORY ${CMAKE_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lamina
            FILES_MATCHING PATTERN "*.hpp" PATTERN "*_impl.hpp" EXCLUDE
            PATTERN "plane_information.hpp" EXCLUDE PATTERN "fallen_planes.hpp" EXCLUDE
            PATTERN "plane_candidates.hpp" EXCLUDE
            PATTERN "raster_*.hpp" EXCLUDE PATTERN "cyclone_*.hpp" EXCLUDE PATTERN "term_group.hpp" EXCLUDE)
  endforeach()
  install(FILES ${CMAKE_SOURCE_DIR}/pipeline/config/lamina.hpp ${CMAKE_BINARY_DIR}/include/lamina/version.hpp
          DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lamina)
  set(destination ${CMAKE_INSTALL_LIBDIR}/cmake/lamina)
  install(EXPORT lamina-targets NAMESPACE lamina:: DESTINATION ${destination})
  lamina_config_dependencies()
  configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/lamina-config.cmake.in
    ${CMAKE_BINARY_DIR}/lamina-config.cmake INSTALL_DESTINATION ${destination})
  write_basic_package_version_file(${CMAKE_BINARY_DIR}/lamina-config-version.cmake
    COMPATIBILITY SameMinorVersion)
  file(GLOB modules ${CMAKE_SOURCE_DIR}/cmake/Find*.cmake)
  install(FILES ${CMAKE_BINARY_DIR}/lamina-config.cmake
                ${CMAKE_BINARY_DIR}/lamina-config-version.cmake ${modules}
          DESTINATION ${destination})
endfunction()
