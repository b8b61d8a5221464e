set(folder ${build}/tests/install)
file(REMOVE_RECURSE ${folder}/prefix ${folder}/own_world ${folder}/examples)

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\nexited with ${status}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${build} --prefix ${folder}/prefix)

# What isn't built is named before anything is copied. The build's own archive is put aside for as long.
file(REMOVE_RECURSE ${folder}/half)
file(RENAME ${build}/models/base/libproxarm_models_base.a ${folder}/aside.a)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${build} --prefix ${folder}/half RESULT_VARIABLE status
                OUTPUT_VARIABLE output ERROR_VARIABLE output)
file(RENAME ${folder}/aside.a ${build}/models/base/libproxarm_models_base.a)
string(REGEX REPLACE "[ \n]+" " " output "${output}")  # CMake wraps its messages, wherever the folder's name ends
string(FIND "${output}" "libproxarm_models_base.a isn't built" said)
if(status EQUAL 0 OR said EQUAL -1 OR EXISTS ${folder}/half)
  message(FATAL_ERROR "half a build was installed, or it wasn't said why not (${status}):\n${output}")
endif()

get_filename_component(source ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
# Docs, manual pages and completion.
file(GLOB_RECURSE docs RELATIVE ${source} ${source}/docs/*.md ${source}/docs/*.png ${source}/docs/*.svg)
foreach(file IN LISTS docs ITEMS README.md CHANGELOG.md)
  list(APPEND rest share/doc/proxarm/${file})
endforeach()
foreach(file IN LISTS rest ITEMS share/man/man1/proxarm.1.gz share/man/man1/proxarm-run.1.gz
        share/bash-completion/completions/proxarm)
  if(NOT EXISTS ${folder}/prefix/${file})
    message(FATAL_ERROR "${file} isn't installed")
  endif()
endforeach()

# Files of the view's page, cells, scenes and hands: each must be installed, whatever its extension.
file(GLOB_RECURSE shipped RELATIVE ${source} ${source}/controller/extras/view/page/* ${source}/models/cells/*.yaml
     ${source}/scenes/*.yaml ${source}/scenes/meshes/* ${source}/sim/hands/*.yaml)
list(FILTER shipped INCLUDE REGEX "\\.[a-z]+$")
foreach(file IN LISTS shipped)
  if(NOT EXISTS ${folder}/prefix/share/proxarm/${file})
    message(FATAL_ERROR "${file} isn't installed")
  endif()
endforeach()

run(${CMAKE_COMMAND} -G Ninja -S ${CMAKE_CURRENT_LIST_DIR}/own_world -B ${folder}/own_world
    -D CMAKE_PREFIX_PATH=${folder}/prefix -D CMAKE_CXX_COMPILER=${compiler} -D CMAKE_BUILD_TYPE=Debug)
run(${CMAKE_COMMAND} --build ${folder}/own_world)
run(${folder}/own_world/own_world)
message(STATUS "${output}")

# The installed examples of docs/how_to/library.md, with the installed data.
run(${CMAKE_COMMAND} -G Ninja -S ${folder}/prefix/share/doc/proxarm/docs/examples -B ${folder}/examples
    -D CMAKE_PREFIX_PATH=${folder}/prefix -D CMAKE_CXX_COMPILER=${compiler} -D CMAKE_BUILD_TYPE=Debug)
run(${CMAKE_COMMAND} --build ${folder}/examples)
foreach(example closed_loop own_world own_sensor own_drive)
  run(${CMAKE_COMMAND} -E env PROXARM_DATA=${folder}/prefix/share/proxarm ${folder}/examples/${example})
  message(STATUS "${example}: ${output}")
endforeach()
