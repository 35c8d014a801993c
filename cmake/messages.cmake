# Generates the Python code of msg/ and srv/ with genpy of Debian, for builds without catkin: for the package
# flatland, and for flatland_msgs, which has the same definitions under the names of the reference.
#
# genpy requires the Python of the system and is called by path: with build isolation of pip, `env python3`
# is a different interpreter, and PYTHONPATH refers to other modules (hence -E).
set(FLATLAND_GENPY_PYTHON /usr/bin/python3)
set(FLATLAND_GENPY_DIR /usr/lib/genpy)
set(FLATLAND_GENPY_INCLUDES
    -Istd_msgs:/usr/share/std_msgs/msg
    -Igeometry_msgs:/usr/share/geometry_msgs/msg
    -Inav_msgs:/usr/share/nav_msgs/msg)

# flatland_generate_messages(PACKAGE OUTPUT_DIR): generates OUTPUT_DIR/msg and OUTPUT_DIR/srv as part of `all`.
# Sets PACKAGE_GENERATED_MSG and PACKAGE_GENERATED_SRV in the caller to the generated files, or to empty lists
# if genpy is not installed.
function(flatland_generate_messages package output_dir)
  foreach(required ${FLATLAND_GENPY_PYTHON} ${FLATLAND_GENPY_DIR}/genmsg_py.py
          ${FLATLAND_GENPY_DIR}/gensrv_py.py /usr/share/std_msgs/msg /usr/share/geometry_msgs/msg
          /usr/share/nav_msgs/msg)
    if(NOT EXISTS ${required})
      message(WARNING
        "${required} not found: building without ROS messages, flatland.ros will not be available. "
        "On Debian: apt-get install python3-genpy ros-std-msgs ros-geometry-msgs ros-nav-msgs")
      set(${package}_GENERATED_MSG PARENT_SCOPE)
      set(${package}_GENERATED_SRV PARENT_SCOPE)
      return()
    endif()
  endforeach()

  set(outputs)
  foreach(kind msg srv)
    string(TOUPPER ${kind} upper)
    set(sources)
    set(generated ${output_dir}/${kind}/__init__.py)
    foreach(file ${FLATLAND_${upper}_FILES})
      get_filename_component(name ${file} NAME_WE)
      list(APPEND sources ${PROJECT_SOURCE_DIR}/${kind}/${file})
      list(APPEND generated ${output_dir}/${kind}/_${name}.py)
    endforeach()
    add_custom_command(
      OUTPUT ${generated}
      DEPENDS ${sources}
      COMMAND ${FLATLAND_GENPY_PYTHON} -E ${FLATLAND_GENPY_DIR}/gen${kind}_py.py ${sources}
              -I${package}:${PROJECT_SOURCE_DIR}/msg ${FLATLAND_GENPY_INCLUDES}
              -p ${package} -o ${output_dir}/${kind}
      COMMAND ${FLATLAND_GENPY_PYTHON} -E ${FLATLAND_GENPY_DIR}/gen${kind}_py.py
              -o ${output_dir}/${kind} --initpy
      COMMENT "Generating ${package}.${kind}"
      VERBATIM)
    list(APPEND outputs ${generated})
    set(${package}_GENERATED_${upper} ${generated} PARENT_SCOPE)
  endforeach()
  add_custom_target(${package}_messages ALL DEPENDS ${outputs})
endfunction()
