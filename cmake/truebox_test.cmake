include(GoogleTest)
# truebox_test(<name> DEPENDS targets... SOURCES files...): one test program, one CTest entry a case.
function(truebox_test name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;SOURCES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} truebox_warnings GTest::gmock_main)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  # What takes time is in the libraries; optimising the tests themselves costs a fifth of their build.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  target_compile_definitions(${name} PRIVATE
    TRUEBOX_REFERENCE_DIR="${PROJECT_SOURCE_DIR}/reference" TRUEBOX_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    TRUEBOX_PROGRAM="$<TARGET_FILE:truebox_program>")
  add_dependencies(${name} truebox_program)
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
endfunction()
