# find_package(squint) -> squint::studies (all of it), squint::truth, squint::pipeline, squint::scene, squint::core, squint::fixedpoint.  Headers: <squint/squint.h>, <squint/pipeline/render.h> ...
include(CMakeFindDependencyMacro)
set(THREADS_PREFER_PTHREAD_FLAG ON)
foreach(package Threads Imath fmt TBB nlohmann_json)
  find_dependency(${package})
endforeach()
include(${CMAKE_CURRENT_LIST_DIR}/squint-targets.cmake)
# Programs find the modules beside the libraries (core/pictures/pictures.h).
get_filename_component(squint_modules ${CMAKE_CURRENT_LIST_DIR}/../../squint ABSOLUTE)
set_property(TARGET squint::core APPEND PROPERTY INTERFACE_LINK_OPTIONS LINKER:-rpath,${squint_modules})
unset(squint_modules)
