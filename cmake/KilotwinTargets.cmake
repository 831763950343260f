# Flags that every target of the project shares, and two functions that declare targets.

add_library(kilotwin_flags INTERFACE)
target_compile_options(kilotwin_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Werror
  # Results must have the same bits whatever compiler and level built them: docs/explanation/determinism.md.
  -ffp-contract=off -fno-fast-math -fno-math-errno)
target_include_directories(kilotwin_flags INTERFACE ${PROJECT_SOURCE_DIR})

set(KILOTWIN_SANITIZE "" CACHE STRING "Sanitizers to build with, as for -fsanitize=")
if(KILOTWIN_SANITIZE)
  target_compile_options(kilotwin_flags INTERFACE -fsanitize=${KILOTWIN_SANITIZE} -fno-omit-frame-pointer
    -fno-sanitize-recover=all)
  target_link_options(kilotwin_flags INTERFACE -fsanitize=${KILOTWIN_SANITIZE})
endif()

# kilotwin_library(NAME SOURCES a.cpp ... DEPENDS target ...): a static library of one folder.
function(kilotwin_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_link_libraries(${name} PUBLIC ${arg_DEPENDS} kilotwin_flags)
endfunction()

# kilotwin_test(NAME SOURCES a_test.cpp ... DEPENDS target ... [TIMEOUT s]): one GoogleTest program, its cases known to ctest.
function(kilotwin_test name)
  cmake_parse_arguments(arg "" "TIMEOUT" "SOURCES;DEPENDS" ${ARGN})
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_DEPENDS} kilotwin_flags GTest::gtest GTest::gtest_main)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${arg_TIMEOUT})
endfunction()
