# Development: `make dev` puts the extension and the messages into the source tree, so that python with
# PYTHONPATH=<checkout> sees them at once. Another folder gets a relay to the source, as catkin's devel space.
include(${CMAKE_CURRENT_LIST_DIR}/messages.cmake)
set(FLATLAND_PACKAGE_DIR ${PROJECT_SOURCE_DIR}/flatland CACHE PATH "Folder that becomes the package flatland")
set(FLATLAND_CORE_OUTPUT_DIR ${FLATLAND_PACKAGE_DIR})
flatland_generate_messages(${FLATLAND_PACKAGE_DIR})
if(NOT FLATLAND_PACKAGE_DIR STREQUAL ${PROJECT_SOURCE_DIR}/flatland)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/devel_relay.py.in ${FLATLAND_PACKAGE_DIR}/__init__.py @ONLY)
endif()
