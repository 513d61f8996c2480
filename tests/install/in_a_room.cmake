# Makes `room` an empty folder of the build, and run(COMMAND...) runs in it.  `output` is what the command prints; a
# failure ends the test.
set(room ${BUILD}/${room})
file(REMOVE_RECURSE ${room})
file(MAKE_DIRECTORY ${room})
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE out WORKING_DIRECTORY ${room})
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGV}\n${out}")
  endif()
  set(output "${out}" PARENT_SCOPE)
endfunction()
