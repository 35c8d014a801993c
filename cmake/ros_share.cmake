# What both installs (pip and catkin) put into share/flatland, said once.

# flatland_install_ros_share(DESTINATION)
function(flatland_install_ros_share destination)
  install(FILES flatland_plugins.xml DESTINATION ${destination} COMPONENT flatland)
  foreach(folder launch msg srv rviz worlds)
    if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/${folder})
      install(DIRECTORY ${folder} DESTINATION ${destination} COMPONENT flatland
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
