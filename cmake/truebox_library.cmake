# Not installed, and no part of the product: see EIGEN_HEADERS.
file(WRITE ${CMAKE_BINARY_DIR}/eigen_headers.cpp "")
add_library(truebox_eigen_headers OBJECT ${CMAKE_BINARY_DIR}/eigen_headers.cpp)
set_target_properties(truebox_eigen_headers PROPERTIES POSITION_INDEPENDENT_CODE ON)
target_compile_features(truebox_eigen_headers PUBLIC cxx_std_20)
target_link_libraries(truebox_eigen_headers PRIVATE Eigen3::Eigen truebox_warnings)
target_precompile_headers(truebox_eigen_headers PRIVATE <Eigen/Dense> <algorithm> <cmath> <functional>
  <map> <span> <string> <vector>)
# truebox_library(<module> [DEPENDS modules...] [PRIVATE libraries...] SOURCES files...)
# A module is a folder is a target: truebox_<module>, alias truebox::<module>, headers installed
# under include/truebox/<module>. DEPENDS are the modules to its left; PRIVATE is its library.
# EIGEN_HEADERS: most of its files include Eigen, which is then parsed once for all such modules.
function(truebox_library module)
  cmake_parse_arguments(ARG "EIGEN_HEADERS" "" "DEPENDS;PRIVATE;PUBLIC;SOURCES" ${ARGN})
  add_library(truebox_${module} STATIC ${ARG_SOURCES})
  add_library(truebox::${module} ALIAS truebox_${module})
  set_target_properties(truebox_${module} PROPERTIES EXPORT_NAME ${module} POSITION_INDEPENDENT_CODE ON)
  target_compile_features(truebox_${module} PUBLIC cxx_std_20)
  cmake_path(GET CMAKE_CURRENT_SOURCE_DIR PARENT_PATH product)
  target_include_directories(truebox_${module} PUBLIC
    $<BUILD_INTERFACE:${product}> $<INSTALL_INTERFACE:include/truebox>)
  list(TRANSFORM ARG_DEPENDS PREPEND truebox::)
  target_link_libraries(truebox_${module} PUBLIC ${ARG_DEPENDS} ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:truebox_warnings>)
  install(TARGETS truebox_${module} EXPORT trueboxTargets ARCHIVE DESTINATION lib)
  install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/ DESTINATION include/truebox/${module}
    FILES_MATCHING PATTERN "*.h" PATTERN "codecs.h" EXCLUDE
    PATTERN "exif_orientation.h" EXCLUDE PATTERN "box_scene.h" EXCLUDE)
  if(ARG_EIGEN_HEADERS)
    target_precompile_headers(truebox_${module} REUSE_FROM truebox_eigen_headers)
  endif()
  set_property(GLOBAL APPEND PROPERTY TRUEBOX_MODULES truebox::${module})
endfunction()
