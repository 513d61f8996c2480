# Installs this build into an empty folder, builds examples/ against it and runs what comes out.
# cmake -DBUILD= -DSOURCE= -DTYPE= -DCOMPILER= -P run.cmake
set(room install-test)
include(${CMAKE_CURRENT_LIST_DIR}/in_a_room.cmake)

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${room}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE}/examples -B ${room}/example -G Ninja -DCMAKE_BUILD_TYPE=${TYPE}
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${room}/prefix)
run(${CMAKE_COMMAND} --build ${room}/example)
run(${room}/example/minimal)
if(NOT output MATCHES "minimal.exr: T is u[0-9.]+ [a-z_]+ [a-z]+, [0-9.]+ dB over [1-9][0-9]* pixels")
  message(FATAL_ERROR "minimal said: ${output}")
endif()
if(NOT EXISTS ${room}/minimal.exr)
  message(FATAL_ERROR "minimal wrote no picture")
endif()
run(${room}/prefix/bin/squint --version)
run(${room}/prefix/bin/squint render @lee_shin/figure_5 --size 16x16 -q -o ${room}/figure_5.exr)
foreach(file share/man/man1/squint-render.1 share/man/man5/squint-scene.5 share/bash-completion/completions/squint
             share/zsh/vendor-completions/_squint share/fish/vendor_completions.d/squint.fish share/doc/squint/docs/scene.md)
  if(NOT EXISTS ${room}/prefix/${file})
    message(FATAL_ERROR "${file} is not installed")
  endif()
endforeach()

# One header for those who want one, without SIMD.
file(WRITE ${room}/one.cpp "#include <squint/squint.h>\n")
run(${COMPILER} -std=c++20 -M -I${room}/prefix/include -I/usr/include/Imath ${room}/one.cpp)
if(output MATCHES "/hwy/" OR NOT output MATCHES "squint/pipeline/render.h")
  message(FATAL_ERROR "squint.h includes: ${output}")
endif()
