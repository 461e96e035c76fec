# Run by ctest: install, configure examples/, and a program that links every library, build, run.
# -DBUILD, -DSOURCE, -DWORK, -DGENERATOR, -DLINK_FLAGS.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT status EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nfailed with ${status}:\n${text}")
  endif()
  set(text "${text}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --build ${BUILD})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)

# Flags that would break the layout of Eigen's types must not reach those who link us.
file(GLOB_RECURSE exported ${WORK}/prefix/*.cmake)
if(NOT exported)
  message(FATAL_ERROR "no CMake files under ${WORK}/prefix")
endif()
foreach(file IN LISTS exported)
  file(READ ${file} text)
  if(text MATCHES "-march|-mavx|-mtune|-ffast-math")
    message(FATAL_ERROR "${file} exports ${CMAKE_MATCH_0}")
  endif()
  if(text MATCHES "${BUILD}/" OR text MATCHES "${SOURCE}/[a-z]")
    message(FATAL_ERROR "${file} names the build or source tree: ${CMAKE_MATCH_0}")
  endif()
endforeach()

set(configure ${CMAKE_COMMAND} -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${WORK}/prefix
    -DCMAKE_BUILD_TYPE=Debug "-DCMAKE_EXE_LINKER_FLAGS=${LINK_FLAGS}")
run(${configure} -S ${SOURCE}/examples -B ${WORK}/examples)
run(${CMAKE_COMMAND} --build ${WORK}/examples)
run(${WORK}/examples/fit_plane)
message(STATUS "${text}")
run(${WORK}/examples/own_sensor ${WORK}/own)
message(STATUS "${text}")
run(${WORK}/examples/read_map ${WORK}/own)
run(${WORK}/examples/query_grid ${WORK}/own 0 0 1 0)

# A library call of the whole line gives what the program gives, byte for byte.
run(${BUILD}/lamina simulate room --output ${WORK}/room --seed 3)
run(${BUILD}/lamina map ${WORK}/room --output ${WORK}/by_program --quiet)
run(${WORK}/examples/map_recording ${WORK}/room ${WORK}/by_library)
file(GLOB_RECURSE written RELATIVE ${WORK}/by_program ${WORK}/by_program/grid/*)
foreach(file IN LISTS written ITEMS trajectory.txt planes.json)
  file(SHA256 ${WORK}/by_program/${file} program)
  file(SHA256 ${WORK}/by_library/${file} library)
  if(NOT program STREQUAL library)
    message(FATAL_ERROR "${file}: the example's bytes differ from the program's")
  endif()
endforeach()

# Factors of one's own: a beacon nobody knows the place of, and positions on the path.
run(${WORK}/examples/own_factor)
run(${WORK}/examples/test_factor)
file(STRINGS ${WORK}/room/groundtruth.txt poses REGEX "^[0-9]")
set(fixes "")
foreach(pose IN LISTS poses)
  string(REGEX REPLACE "^([^ ]+ [^ ]+ [^ ]+ [^ ]+) .*" "\\1 0.05" fix "${pose}")
  string(APPEND fixes "${fix}\n")
endforeach()
file(WRITE ${WORK}/fixes.txt "${fixes}")
run(${WORK}/examples/gps_factor ${WORK}/room ${WORK}/fixes.txt ${WORK}/by_fixes)
file(READ ${WORK}/by_fixes/metrics.json metrics)
if(NOT metrics MATCHES "\"gps\"")
  message(FATAL_ERROR "gps_factor: metrics.json names no factor of kind gps")
endif()

# Every library at once: all that their third-party packages need is found by lamina-config.cmake.
file(WRITE ${WORK}/every/CMakeLists.txt [=[
cmake_minimum_required(VERSION 3.25)
project(every LANGUAGES CXX)
find_package(lamina REQUIRED)
add_executable(every every.cpp)
foreach(name IN LISTS lamina_LIBRARIES)
  target_link_libraries(every PRIVATE lamina::${name})
endforeach()
]=])
file(WRITE ${WORK}/every/every.cpp [=[
#include <lamina/models/plane.hpp>
int main() { return lamina::Plane().rho() == 0 ? 0 : 1; }
]=])
run(${configure} -S ${WORK}/every -B ${WORK}/every/build)
run(${CMAKE_COMMAND} --build ${WORK}/every/build)
run(${WORK}/every/build/every)
