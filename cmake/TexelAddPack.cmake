# texel_add_pack(NAME SCENE FILE... OUTPUT FOLDER [RECIPE FILE] [OPTIONS OPTION...])
#
# A target NAME, built by default, that bakes the scene files into one pack. It is baked anew when a scene file, one of its .mtl
# files or textures, the recipe or the program changes; the program writes that list itself. Relative scene files are meant from
# the current source folder, a relative OUTPUT from the current binary folder.
function(texel_add_pack name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "OUTPUT;RECIPE" "SCENE;OPTIONS")
  if(NOT arg_SCENE OR NOT arg_OUTPUT OR arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "texel_add_pack(${name}): needs SCENE and OUTPUT; not understood: \"${arg_UNPARSED_ARGUMENTS}\"")
  endif()
  set(scene "")
  foreach(file IN LISTS arg_SCENE)
    cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
    list(APPEND scene "${file}")
  endforeach()
  cmake_path(ABSOLUTE_PATH arg_OUTPUT BASE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}" NORMALIZE OUTPUT_VARIABLE output)
  set(recipe "")
  if(arg_RECIPE)
    cmake_path(ABSOLUTE_PATH arg_RECIPE BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
    set(recipe --recipe "${arg_RECIPE}")
  endif()
  set(depfile "${CMAKE_CURRENT_BINARY_DIR}/${name}.texel.d")
  # The manifest is written last, so it stands for the pack.
  add_custom_command(OUTPUT "${output}/manifest.json"
    COMMAND texel::texel bake ${scene} -o "${output}" ${recipe} --depfile "${depfile}" ${arg_OPTIONS}
    DEPENDS ${scene} ${arg_RECIPE} texel::texel
    DEPFILE "${depfile}"
    COMMENT "Baking ${output}"
    VERBATIM)
  add_custom_target(${name} ALL DEPENDS "${output}/manifest.json")
  set_target_properties(${name} PROPERTIES TEXEL_PACK "${output}")
endfunction()
