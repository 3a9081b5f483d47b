# embed_text(<out.cpp> <variable> <file>): a text file as `truebox::embedded::<variable>`, so that
# the program finds it in the build tree, in the install tree and anywhere else alike.
function(embed_text output variable file)
  set_property(DIRECTORY APPEND PROPERTY
    CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  file(READ ${CMAKE_CURRENT_SOURCE_DIR}/${file} text)
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${output} @ONLY CONTENT
"// Generated from @file@: edit that file.
namespace truebox::embedded {
extern const char* const @variable@;
const char* const @variable@ = R\"~~~~(@text@)~~~~\";
}  // namespace truebox::embedded
")
endfunction()
