# Generates the Python code of msg/ and srv/ with Debian's genpy, for builds that catkin does not drive.
#
# genpy belongs to the system's Python and is called by path: under pip's build isolation `env python3`
# is another interpreter, and PYTHONPATH leads elsewhere (hence -E).
set(FLATLAND_GENPY_PYTHON /usr/bin/python3)
set(FLATLAND_GENPY_DIR /usr/lib/genpy)
set(FLATLAND_GENPY_INCLUDES
    -Iflatland:${PROJECT_SOURCE_DIR}/msg
    -Istd_msgs:/usr/share/std_msgs/msg
    -Igeometry_msgs:/usr/share/geometry_msgs/msg)

# flatland_generate_messages(OUTPUT_DIR): fills OUTPUT_DIR/msg and OUTPUT_DIR/srv as part of `all`.
# Sets FLATLAND_GENERATED_MSG and FLATLAND_GENERATED_SRV, the files, in the caller; empty without genpy.
function(flatland_generate_messages output_dir)
  foreach(needed ${FLATLAND_GENPY_PYTHON} ${FLATLAND_GENPY_DIR}/genmsg_py.py
          ${FLATLAND_GENPY_DIR}/gensrv_py.py /usr/share/std_msgs/msg /usr/share/geometry_msgs/msg)
    if(NOT EXISTS ${needed})
      message(WARNING
        "${needed} is missing: building without ROS messages, so without flatland.ros. "
        "On Debian: apt-get install python3-genpy ros-std-msgs ros-geometry-msgs")
      set(FLATLAND_GENERATED_MSG PARENT_SCOPE)
      set(FLATLAND_GENERATED_SRV PARENT_SCOPE)
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
              ${FLATLAND_GENPY_INCLUDES} -p flatland -o ${output_dir}/${kind}
      COMMAND ${FLATLAND_GENPY_PYTHON} -E ${FLATLAND_GENPY_DIR}/gen${kind}_py.py
              -o ${output_dir}/${kind} --initpy
      COMMENT "Generating flatland.${kind}"
      VERBATIM)
    list(APPEND outputs ${generated})
    set(FLATLAND_GENERATED_${upper} ${generated} PARENT_SCOPE)
  endforeach()
  add_custom_target(flatland_messages ALL DEPENDS ${outputs})
endfunction()
