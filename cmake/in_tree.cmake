# Development: python with PYTHONPATH=<checkout> sees the extension and the messages at once.
include(${CMAKE_CURRENT_LIST_DIR}/messages.cmake)
set(FLATLAND_CORE_OUTPUT_DIR ${PROJECT_SOURCE_DIR}/flatland)
flatland_generate_messages(${PROJECT_SOURCE_DIR}/flatland)
