# Defines the target `flatland_box2d`: the Box2D library of the system or, in wheels that require no other package,
# the sources of Box2D 2.4.1 compiled into the extension.
set(FLATLAND_BOX2D_SOURCE "" CACHE PATH
    "Folder of the sources of Box2D 2.4.1, for an extension that contains Box2D; empty for the library of the system")

add_library(flatland_box2d INTERFACE)
if(FLATLAND_BOX2D_SOURCE)
  file(GLOB_RECURSE sources ${FLATLAND_BOX2D_SOURCE}/src/*.cpp)
  if(NOT sources)
    message(FATAL_ERROR "FLATLAND_BOX2D_SOURCE must contain the sources of Box2D, got ${FLATLAND_BOX2D_SOURCE}")
  endif()
  add_library(box2d_static STATIC ${sources})
  target_include_directories(box2d_static PRIVATE ${FLATLAND_BOX2D_SOURCE}/src)
  target_include_directories(box2d_static SYSTEM PUBLIC ${FLATLAND_BOX2D_SOURCE}/include)
  target_compile_features(box2d_static PRIVATE cxx_std_11)
  # Results equal those of the library of Debian, which contains the assertions of Box2D as well.
  target_compile_options(box2d_static PRIVATE -ffp-contract=off -UNDEBUG)
  set_target_properties(box2d_static PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden)
  target_link_libraries(flatland_box2d INTERFACE box2d_static)
else()
  find_package(box2d CONFIG)
  if(NOT box2d_FOUND)
    message(FATAL_ERROR "Box2D not found. On Debian: apt-get install libbox2d-dev. Otherwise, set "
                        "FLATLAND_BOX2D_SOURCE to a folder with the sources of Box2D 2.4.1")
  endif()
  target_link_libraries(flatland_box2d INTERFACE box2d::box2d)
endif()
