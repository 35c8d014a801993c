# Wheel build. scikit-build-core adds flatland/**/*.py (pyproject.toml). This file adds the generated files,
# and the data of the ROS package, which is installed in <environment>/share/flatland.
include(${CMAKE_CURRENT_LIST_DIR}/messages.cmake)

set(FLATLAND_CORE_INSTALL_DIR ${SKBUILD_PLATLIB_DIR}/flatland)

if(FLATLAND_BOX2D_SOURCE)
  install(FILES ${FLATLAND_BOX2D_SOURCE}/LICENSE
          DESTINATION ${SKBUILD_METADATA_DIR}/licenses/box2d COMPONENT flatland)
endif()

foreach(package flatland flatland_msgs)
  flatland_generate_messages(${package} ${PROJECT_BINARY_DIR}/messages/${package})
  foreach(kind msg srv)
    string(TOUPPER ${kind} upper)
    install(FILES ${${package}_GENERATED_${upper}}
            DESTINATION ${SKBUILD_PLATLIB_DIR}/${package}/${kind} COMPONENT flatland)
  endforeach()
endforeach()
if(flatland_msgs_GENERATED_MSG)
  file(WRITE ${PROJECT_BINARY_DIR}/messages/flatland_msgs/__init__.py "")
  install(FILES ${PROJECT_BINARY_DIR}/messages/flatland_msgs/__init__.py
          DESTINATION ${SKBUILD_PLATLIB_DIR}/flatland_msgs COMPONENT flatland)
endif()

include(${CMAKE_CURRENT_LIST_DIR}/ros_share.cmake)
flatland_install_ros_share(${SKBUILD_DATA_DIR}/share/flatland)
install(FILES catkin/flatland/package.xml DESTINATION ${SKBUILD_DATA_DIR}/share/flatland COMPONENT flatland)

# The packages with the names of the reference.
foreach(package flatland_msgs flatland_plugins flatland_server flatland_viz)
  install(FILES compat/${package}/package.xml DESTINATION ${SKBUILD_DATA_DIR}/share/${package} COMPONENT flatland)
  foreach(folder launch msg srv)
    if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/compat/${package}/${folder})
      # msg and srv are symbolic links, which install() would copy.
      get_filename_component(contents ${PROJECT_SOURCE_DIR}/compat/${package}/${folder} REALPATH)
      install(DIRECTORY ${contents}/
              DESTINATION ${SKBUILD_DATA_DIR}/share/${package}/${folder} COMPONENT flatland)
    endif()
  endforeach()
endforeach()

# Each script has a console entry point of the same name (pyproject.toml), which pip installs with the
# interpreter of the environment.
function(flatland_install_launcher package name arguments)
  set(launcher ${PROJECT_BINARY_DIR}/programs/${package}/${name})
  configure_file(cmake/prefix_launcher.sh.in ${launcher} @ONLY)
  install(PROGRAMS ${launcher} DESTINATION ${SKBUILD_DATA_DIR}/share/${package}/scripts COMPONENT flatland)
endfunction()
flatland_ros_scripts(scripts)
foreach(script ${scripts})
  get_filename_component(name ${script} NAME)
  flatland_install_launcher(flatland ${name} "")
endforeach()
flatland_install_launcher(flatland_server flatland_server " --msgs-package flatland_msgs")
flatland_install_launcher(flatland_server map_to_lines.py "")
flatland_install_launcher(flatland_viz flatland_viz "")
