# The one place where flags are set. lamina_add_library / lamina_add_test / lamina_add_app.
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
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/include)
file(CREATE_LINK ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}/include/lamina SYMBOLIC)

# Eigen and the standard containers are parsed once: 2 s less for every file.
function(lamina_precompiled_header)
  add_library(lamina_pch STATIC ${CMAKE_SOURCE_DIR}/cmake/pch.cpp)
  target_link_libraries(lamina_pch PRIVATE Eigen3::Eigen)
  lamina_set_flags(lamina_pch)
  target_precompile_headers(lamina_pch PRIVATE <Eigen/Core> <Eigen/Geometry> <algorithm> <cmath> <cstdint>
    <functional> <map> <memory> <optional> <set> <span> <string> <unordered_map> <variant> <vector>)
  target_compile_options(lamina_pch PRIVATE -fpch-preprocess)
endfunction()

function(lamina_set_flags target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  # One code model for libraries and programs alike, so that they share the precompiled header.
  target_compile_options(${target} PRIVATE -fPIC)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wold-style-cast)
  # The same bytes on every x86-64: no fused multiply-add contraction across machines.
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  if(TARGET lamina_pch AND NOT target STREQUAL lamina_pch AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -fpch-preprocess)
    target_precompile_headers(${target} REUSE_FROM lamina_pch)
  endif()
  if(LAMINA_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(LAMINA_EIGEN_NAN)
    target_compile_definitions(${target} PRIVATE EIGEN_INITIALIZE_MATRICES_BY_NAN)
  endif()
  if(LAMINA_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${LAMINA_SANITIZE} -fno-omit-frame-pointer
                                             -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${LAMINA_SANITIZE})
  endif()
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
  set_property(GLOBAL APPEND PROPERTY LAMINA_LIBRARIES ${target})
endfunction()

# lamina_add_test(NAME SOURCES... LINK targets... [LABELS ...]) makes NAME_test and lists each TEST in ctest.
function(lamina_add_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name}_test ${ARG_SOURCES})
  lamina_set_flags(${name}_test)
  target_link_libraries(${name}_test PRIVATE ${ARG_LINK} GTest::gmock_main)
  target_compile_definitions(${name}_test PRIVATE LAMINA_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
                                                  LAMINA_BINARY_DIR="${CMAKE_BINARY_DIR}")
  gtest_discover_tests(${name}_test DISCOVERY_MODE PRE_TEST
                       PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}")
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

# Headers, libraries, and lamina-config.cmake, so that others say find_package(lamina).
function(lamina_install)
  include(CMakePackageConfigHelpers)
  get_property(libraries GLOBAL PROPERTY LAMINA_LIBRARIES)
  install(TARGETS ${libraries} EXPORT lamina-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  foreach(folder models sensors frontend backend grid io sim)
    install(DIRECTORY ${CMAKE_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lamina
            FILES_MATCHING PATTERN "*.hpp")
  endforeach()
  set(destination ${CMAKE_INSTALL_LIBDIR}/cmake/lamina)
  install(EXPORT lamina-targets NAMESPACE lamina:: DESTINATION ${destination})
  configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/lamina-config.cmake.in
    ${CMAKE_BINARY_DIR}/lamina-config.cmake INSTALL_DESTINATION ${destination})
  write_basic_package_version_file(${CMAKE_BINARY_DIR}/lamina-config-version.cmake
    COMPATIBILITY SameMinorVersion)
  install(FILES ${CMAKE_BINARY_DIR}/lamina-config.cmake
                ${CMAKE_BINARY_DIR}/lamina-config-version.cmake DESTINATION ${destination})
endfunction()
