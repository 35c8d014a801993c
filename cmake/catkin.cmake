# Build with catkin_make, for the devel and install spaces.
#
# There is no setup.py: setuptools of Debian does not support the metadata of pyproject.toml, and
# catkin_python_setup() would add the root of the repository to sys.path. Instead, the package in the devel
# space is a relay to the source package.
find_package(catkin REQUIRED COMPONENTS geometry_msgs message_generation nav_msgs std_msgs)

# Build the extension for the Python interpreter of ROS, selected by catkin.
set(Python_EXECUTABLE ${PYTHON_EXECUTABLE})

# flatland/__init__.py exists: generate_messages() must neither write nor install one.
set(${PROJECT_NAME}_CATKIN_PYTHON_SETUP_HAS_PACKAGE_INIT TRUE)
add_message_files(DIRECTORY msg FILES ${FLATLAND_MSG_FILES})
add_service_files(DIRECTORY srv FILES ${FLATLAND_SRV_FILES})
generate_messages(DEPENDENCIES geometry_msgs nav_msgs std_msgs)

catkin_package(CATKIN_DEPENDS geometry_msgs message_runtime nav_msgs std_msgs)

set(FLATLAND_DEVEL_PACKAGE_DIR ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_PYTHON_DESTINATION})
set(FLATLAND_CORE_OUTPUT_DIR ${FLATLAND_DEVEL_PACKAGE_DIR})
configure_file(${CMAKE_CURRENT_LIST_DIR}/devel_relay.py.in ${FLATLAND_DEVEL_PACKAGE_DIR}/__init__.py @ONLY)

set(FLATLAND_CORE_INSTALL_DIR ${CATKIN_PACKAGE_PYTHON_DESTINATION})
# msg, srv and _core in the source tree are results of `make dev`; catkin installs its own.
get_filename_component(python_package ${PROJECT_SOURCE_DIR}/flatland REALPATH)
install(
  DIRECTORY ${python_package}/
  DESTINATION ${CATKIN_PACKAGE_PYTHON_DESTINATION} COMPONENT flatland
  PATTERN "__pycache__" EXCLUDE
  PATTERN "*~" EXCLUDE
  PATTERN "_core*.so" EXCLUDE
  REGEX "/flatland/(msg|srv)$" EXCLUDE)

include(${CMAKE_CURRENT_LIST_DIR}/ros_share.cmake)
flatland_install_ros_share(${CATKIN_PACKAGE_SHARE_DESTINATION})
flatland_ros_scripts(scripts)
catkin_install_python(PROGRAMS ${scripts} DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
