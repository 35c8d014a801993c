# Contents of share/flatland, common to the installations by pip and by catkin.

# flatland_install_ros_share(DESTINATION)
function(flatland_install_ros_share destination)
  # A symbolic link to the manifest in the Python package; install() would copy the link.
  get_filename_component(manifest ${PROJECT_SOURCE_DIR}/flatland_plugins.xml REALPATH)
  install(FILES ${manifest} DESTINATION ${destination} COMPONENT flatland)
  foreach(folder launch msg srv rviz worlds)
    if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/${folder})
      # In catkin/flatland, the folder is a symbolic link, which install() would copy.
      get_filename_component(contents ${PROJECT_SOURCE_DIR}/${folder} REALPATH)
      install(DIRECTORY ${contents}/ DESTINATION ${destination}/${folder} COMPONENT flatland
              PATTERN "*.py" EXCLUDE  # generators of the maps
              PATTERN "__pycache__" EXCLUDE
              PATTERN "*~" EXCLUDE)
    endif()
  endforeach()
endfunction()

# flatland_ros_scripts(OUT): sets OUT to the paths of the programs for roslaunch and rosrun.
function(flatland_ros_scripts out)
  file(GLOB found CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/scripts/*)
  set(${out} ${found} PARENT_SCOPE)
endfunction()
