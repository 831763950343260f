# Flags that all targets share, and the functions that declare targets.

set(KILOTWIN_SANITIZE "" CACHE STRING "Sanitizers to build with, as for -fsanitize=")
option(KILOTWIN_WERROR "Treat warnings as errors" OFF)
option(KILOTWIN_UNITY "Compile the sources of a target several to a unit" ON)
option(KILOTWIN_PCH "Precompile the headers of the standard library and of the packages" ON)

add_library(kilotwin_flags INTERFACE)
target_compile_options(kilotwin_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
  # Results must have the same bits for any compiler and level: docs/explanation/determinism.md.
  -ffp-contract=off -fno-fast-math -fno-math-errno)
# gcc 12 sees copies beyond a std::string that do not happen (its defect 105651), once the string is a precompiled header's.
target_compile_options(kilotwin_flags INTERFACE
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds;-Wno-stringop-overflow;-Wno-stringop-overread;-Wno-restrict>")
if(KILOTWIN_WERROR)
  target_compile_options(kilotwin_flags INTERFACE -Werror)
endif()
if(KILOTWIN_SANITIZE)
  target_compile_options(kilotwin_flags INTERFACE
    -fsanitize=${KILOTWIN_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(kilotwin_flags INTERFACE -fsanitize=${KILOTWIN_SANITIZE})
  # With this macro protobuf's headers give a class two members that the distribution's library, compiled without, has not.
  target_compile_options(kilotwin_flags INTERFACE -U__SANITIZE_THREAD__)
endif()

# Headers that most units include, precompiled once for libraries and once for tests. A unit still includes what it uses: with
# -DKILOTWIN_PCH=OFF everything builds too, as in scripts/test --debug.
set(kilotwin_precompiled
  <algorithm> <array> <charconv> <chrono> <cmath> <condition_variable> <cstdint> <cstring> <deque> <filesystem> <fstream>
  <functional> <limits> <map> <memory> <mutex> <numeric> <optional> <random> <set> <span> <sstream> <string> <string_view>
  <thread> <utility> <variant> <vector>
  <fmt/format.h> <Eigen/Core> <google/protobuf/arena.h> <google/protobuf/extension_set.h>
  <google/protobuf/generated_message_reflection.h> <google/protobuf/message.h> <google/protobuf/repeated_field.h>)
if(KILOTWIN_PCH)
  # fmt says by a macro that it is a shared library. All units must agree on it, or the precompiled headers do not fit.
  target_link_libraries(kilotwin_flags INTERFACE fmt::fmt)
  # ccache finds the precompiled header of a unit by this.
  target_compile_options(kilotwin_flags INTERFACE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fpch-preprocess>)
  file(WRITE ${CMAKE_BINARY_DIR}/precompiled.cpp "")
  add_library(kilotwin_precompiled OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
  target_link_libraries(kilotwin_precompiled PRIVATE kilotwin_flags Eigen3::Eigen protobuf::libprotobuf)
  target_precompile_headers(kilotwin_precompiled PRIVATE ${kilotwin_precompiled})
endif()
set(kilotwin_precompiled_target kilotwin_precompiled)

# kilotwin_precompiled_also(NAME HEADER...): precompiles these headers too, as target NAME, and uses them for the targets that the
# present folder declares from here on.
macro(kilotwin_precompiled_also name)
  if(KILOTWIN_PCH)
    add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
    target_link_libraries(${name} PRIVATE kilotwin_flags Eigen3::Eigen protobuf::libprotobuf)
    target_precompile_headers(${name} PRIVATE ${kilotwin_precompiled} ${ARGN})
    set(kilotwin_precompiled_target ${name})
  endif()
endmacro()

# kilotwin_precompile(NAME FROM TARGET): NAME uses the precompiled headers of TARGET.
function(kilotwin_precompile name)
  cmake_parse_arguments(arg "" "FROM" "" ${ARGN})
  get_target_property(sources ${name} SOURCES)
  if(KILOTWIN_PCH AND sources MATCHES "\\.(cpp|cc)(;|$)")
    target_precompile_headers(${name} REUSE_FROM ${arg_FROM})
  endif()
endfunction()

# kilotwin_unite(NAME): compiles the sources of NAME several to a unit, so that they share the headers that they include and the
# templates that they instantiate. Names in anonymous namespaces must then be unique among the sources of a target.
function(kilotwin_unite name)
  if(KILOTWIN_UNITY)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
    # gcc takes the sources of a unit for headers, whose types must not depend on anonymous namespaces.
    target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()

# kilotwin_library(NAME SOURCES a.cpp ... DEPENDS target ...): a static library of one folder, with the include path of
# its headers. tests/layers defines which folder may include which.
function(kilotwin_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${arg_DEPENDS} kilotwin_flags)
  kilotwin_precompile(${name} FROM ${kilotwin_precompiled_target})
  kilotwin_unite(${name})
endfunction()

# kilotwin_program(NAME SOURCES a.cpp ... DEPENDS target ...): an executable that is not a test.
function(kilotwin_program name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${arg_DEPENDS} kilotwin_flags)
  kilotwin_precompile(${name} FROM ${kilotwin_precompiled_target})
  kilotwin_unite(${name})
endfunction()

# kilotwin_test(NAME SOURCES a_test.cpp ... DEPENDS target ... [TIMEOUT s] [LABELS label ...]): one GoogleTest program, each
# case of which is a ctest. Labels: fast (the default), dds (federates over Cyclone DDS), system (the program as users run it), slow
# (statistics, fuzzing, identification). A fast program is one more ctest as a whole, with the label whole: a process per case
# would take most of the time. The test preset "fast" runs these, all others leave them out. SLOW_CASES names cases of a fast program
# that are slow, as patterns of --gtest_filter. ALONE: no other test runs beside it.
function(kilotwin_test name)
  cmake_parse_arguments(arg "ALONE" "TIMEOUT" "SOURCES;DEPENDS;LABELS;SLOW_CASES" ${ARGN})
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  if(NOT arg_LABELS)
    set(arg_LABELS fast)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${arg_DEPENDS} kilotwin_flags GTest::gtest GTest::gtest_main)
  kilotwin_precompile(${name} FROM kilotwin_precompiled_test)
  kilotwin_unite(${name})
  list(JOIN arg_SLOW_CASES ":" slow)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 300 TEST_FILTER "-${slow}"
    PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}" RUN_SERIAL "${arg_ALONE}")
  if(slow)
    gtest_discover_tests(${name} DISCOVERY_TIMEOUT 300 TEST_FILTER "${slow}" TEST_LIST ${name}_SLOW_TESTS
      PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS slow)
  endif()
  if(arg_LABELS STREQUAL fast)
    add_test(NAME ${name} COMMAND ${name} --gtest_brief=1 "--gtest_filter=-${slow}")
    set_tests_properties(${name} PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "inner;whole")
  endif()
endfunction()
