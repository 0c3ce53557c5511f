# Headers of packages are half of what a small unit compiles: GCC reads them once. ccache
# is told to take what is defined in them as known, and to tell them apart by what they are
# made of: each has the paths of its build folder in it.
if(RAYMORTAR_PCH)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-fpch-preprocess)
  endif()
  if("${CMAKE_CXX_COMPILER_LAUNCHER}" MATCHES "ccache$")
    set(CMAKE_CXX_COMPILER_LAUNCHER
        "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros
        CCACHE_PCH_EXTSUM=true ${CMAKE_CXX_COMPILER_LAUNCHER})
  endif()
endif()

# precompile(TARGET HEADER...): headers of packages alone, or no unit could be compiled
# without the others'
function(precompile target)
  if(RAYMORTAR_PCH)
    target_precompile_headers(${target} PRIVATE ${ARGN})
    file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/cmake_pch.hxx.gch.sum"
         "${CMAKE_CXX_COMPILER_VERSION} ${Eigen3_VERSION} ${pybind11_VERSION} ${ARGN}")
  endif()
endfunction()
