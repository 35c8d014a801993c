# What both installs (pip and catkin) put into share/flatland, said once.

# flatland_install_ros_share(DESTINATION)
function(flatland_install_ros_share destination)
  # A link to the manifest in the Python package; install() would copy the link.
  get_filename_component(manifest ${PROJECT_SOURCE_DIR}/flatland_plugins.xml REALPATH)
  install(FILES ${manifest} DESTINATION ${destination} COMPONENT flatland)
  foreach(folder launch msg srv rviz worlds)
    if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/${folder})
      install(DIRECTORY ${folder} DESTINATION ${destination} COMPONENT flatland
              PATTERN "*.py" EXCLUDE  # draws worlds/, is no part of them
              PATTERN "__pycache__" EXCLUDE
              PATTERN "*~" EXCLUDE)
    endif()
  endforeach()
endfunction()

# flatland_ros_scripts(OUT): the programs that roslaunch and rosrun start, as paths.
function(flatland_ros_scripts out)
  file(GLOB found CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/scripts/*)
  set(${out} ${found} PARENT_SCOPE)
endfunction()
