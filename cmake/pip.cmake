# Wheel build. scikit-build-core adds flatland/**/*.py (pyproject.toml). This file adds the generated files,
# and the data of the ROS package, which is installed in <environment>/share/flatland.
include(${CMAKE_CURRENT_LIST_DIR}/messages.cmake)

set(FLATLAND_CORE_INSTALL_DIR ${SKBUILD_PLATLIB_DIR}/flatland)

flatland_generate_messages(${PROJECT_BINARY_DIR}/messages/flatland)
install(FILES ${FLATLAND_GENERATED_MSG} DESTINATION ${SKBUILD_PLATLIB_DIR}/flatland/msg COMPONENT flatland)
install(FILES ${FLATLAND_GENERATED_SRV} DESTINATION ${SKBUILD_PLATLIB_DIR}/flatland/srv COMPONENT flatland)

include(${CMAKE_CURRENT_LIST_DIR}/ros_share.cmake)
flatland_install_ros_share(${SKBUILD_DATA_DIR}/share/flatland)
install(FILES package.xml DESTINATION ${SKBUILD_DATA_DIR}/share/flatland COMPONENT flatland)

# Each script has a console entry point of the same name (pyproject.toml), which pip installs with the
# interpreter of the environment.
flatland_ros_scripts(scripts)
foreach(script ${scripts})
  get_filename_component(name ${script} NAME)
  configure_file(cmake/prefix_launcher.sh.in ${PROJECT_BINARY_DIR}/launchers/${name} @ONLY)
  install(PROGRAMS ${PROJECT_BINARY_DIR}/launchers/${name}
          DESTINATION ${SKBUILD_DATA_DIR}/share/flatland/scripts COMPONENT flatland)
endforeach()
