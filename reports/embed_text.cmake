# embed_text(<out.cpp> <variable> <files>...): text files (of this folder, or full paths), one after
# the other, as `truebox::embedded::<variable>`, so that the program finds them in the build tree, in
# the install tree and anywhere else alike.
function(embed_text output variable)
  set(text "")
  foreach(file IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH file)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    file(READ ${file} part)
    string(APPEND text "${part}")
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${output} @ONLY CONTENT
"// Generated from @ARGN@: edit there.
namespace truebox::embedded {
extern const char* const @variable@;
const char* const @variable@ = R\"~~~~(@text@)~~~~\";
}  // namespace truebox::embedded
")
endfunction()
