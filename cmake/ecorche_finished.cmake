# SPDX-License-Identifier: Apache-2.0
# A build with sanitizers watches what the program does. The tests' own sources, and units that are mostly somebody else's
# templates, need not be compiled once more for that: they are linked from a finished build without sanitizers, whose folder
# ECORCHE_FINISHED names; it is brought up to date first. That is a third of such a build. Where nothing was built there, all is
# compiled here.

# ecorche_list_objects(TARGET): leaves the list of the target's objects for other builds.
function(ecorche_list_objects name)
  if(NOT ECORCHE_SANITIZE)
    file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/objects/${name}.txt CONTENT "$<TARGET_OBJECTS:${name}>")
  endif()
endfunction()

# ecorche_finished_objects(TARGET SOURCES): puts the finished objects in place of the sources, where there are such.
function(ecorche_finished_objects name sources)
  set(list ${ECORCHE_FINISHED}/objects/${name}.txt)
  if(NOT ECORCHE_FINISHED OR NOT ECORCHE_SANITIZE OR ECORCHE_FUZZ OR NOT EXISTS ${list})
    return()
  endif()
  file(READ ${list} objects)
  set_source_files_properties(${objects} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  set_property(GLOBAL APPEND PROPERTY ecorche_finished_objects ${objects})
  set_property(GLOBAL APPEND PROPERTY ecorche_finished_targets ${name})
  set(${sources} ${objects} PARENT_SCOPE)
endfunction()

# ecorche_link_first(TEST LIBS...): the linker keeps the first copy that it meets of an inline function or a template. It
# meets those of the libraries under test first: so the watched ones are kept.
function(ecorche_link_first name)
  set(archives "")
  foreach(lib ${ARGN})
    if(TARGET ${lib})
      get_target_property(type ${lib} TYPE)
      get_target_property(imported ${lib} IMPORTED)
      if(type STREQUAL "STATIC_LIBRARY" AND NOT imported)
        list(APPEND archives $<TARGET_FILE:${lib}>)
      endif()
    endif()
  endforeach()
  target_link_options(${name} BEFORE PRIVATE -Wl,--whole-archive ${archives} -Wl,--no-whole-archive)
endfunction()

# ecorche_finish(): called once all targets are there, makes the build that they take from bring itself up to date first.
function(ecorche_finish)
  get_property(objects GLOBAL PROPERTY ecorche_finished_objects)
  get_property(targets GLOBAL PROPERTY ecorche_finished_targets)
  if(targets)
    add_custom_target(ecorche_finished COMMAND ${CMAKE_COMMAND} --build ${ECORCHE_FINISHED} --target unit_tests
      BYPRODUCTS ${objects} USES_TERMINAL COMMENT "What sanitizers need not watch, from ${ECORCHE_FINISHED}")
    foreach(target ${targets})
      add_dependencies(${target} ecorche_finished)
    endforeach()
  endif()
endfunction()
