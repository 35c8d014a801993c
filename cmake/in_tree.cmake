# Development build: `make dev` builds the extension and the messages in the source tree, for use with
# PYTHONPATH=<checkout>. The package flatland_msgs is that of .venv. Any other package folder gets a relay to the source
# tree, like the devel space of catkin.
include(${CMAKE_CURRENT_LIST_DIR}/messages.cmake)
set(FLATLAND_PACKAGE_DIR ${PROJECT_SOURCE_DIR}/flatland CACHE PATH "Folder of the package flatland")
set(FLATLAND_CORE_OUTPUT_DIR ${FLATLAND_PACKAGE_DIR})
flatland_generate_messages(flatland ${FLATLAND_PACKAGE_DIR})
if(NOT FLATLAND_PACKAGE_DIR STREQUAL ${PROJECT_SOURCE_DIR}/flatland)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/devel_relay.py.in ${FLATLAND_PACKAGE_DIR}/__init__.py @ONLY)
endif()
