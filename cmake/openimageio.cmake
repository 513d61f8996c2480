find_package(OpenImageIO REQUIRED)
# OpenImageIO 2.4.7's exported target names a folder of OpenCV that need not exist: generation would fail.
foreach(property INTERFACE_INCLUDE_DIRECTORIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES)
  get_target_property(folders OpenImageIO::OpenImageIO ${property})
  if(folders)
    list(FILTER folders EXCLUDE REGEX "opencv")
    set_target_properties(OpenImageIO::OpenImageIO PROPERTIES ${property} "${folders}")
  endif()
endforeach()
