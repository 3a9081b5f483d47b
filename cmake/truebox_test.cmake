include(GoogleTest)
# Parsed once instead of in every test: half of their compile time.
file(WRITE ${CMAKE_BINARY_DIR}/test_headers.cpp "")
add_library(truebox_test_headers OBJECT ${CMAKE_BINARY_DIR}/test_headers.cpp)
target_compile_features(truebox_test_headers PUBLIC cxx_std_20)
target_compile_options(truebox_test_headers PRIVATE $<$<CONFIG:Release>:-O1>)
target_link_libraries(truebox_test_headers PRIVATE GTest::gmock Eigen3::Eigen truebox_warnings)
target_precompile_headers(truebox_test_headers PRIVATE <gmock/gmock.h> <gtest/gtest.h> <Eigen/Dense>
  <algorithm> <cmath> <filesystem> <fstream> <map> <random> <string> <vector>)
# truebox_test(<name> DEPENDS targets... SOURCES files...): one test program, one CTest entry a case.
function(truebox_test name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;SOURCES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} truebox_warnings GTest::gmock_main)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  # What takes time is in the libraries; optimising the tests themselves costs a fifth of their build.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  target_precompile_headers(${name} REUSE_FROM truebox_test_headers)
  target_compile_definitions(${name} PRIVATE
    TRUEBOX_REFERENCE_DIR="${PROJECT_SOURCE_DIR}/reference" TRUEBOX_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    TRUEBOX_PROGRAM="$<TARGET_FILE:truebox_program>")
  add_dependencies(${name} truebox_program)
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
endfunction()
