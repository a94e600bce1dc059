# tandem_add_render_test(NAME name
#     [SCENE scene...]        files, or names of shipped scenes: cornell-classic, closed-forms/polygon-light
#     [PRESET preset]         smoke, driver or full; in place of scenes
#     [CANDIDATE renderer]    what is judged: 'exec:COMMAND', vulkan (default) or cpu
#     [REFERENCE renderer]    what is trusted: cpu (default), vulkan, oracle or 'exec:COMMAND'
#     [TIME seconds]          of a scene, at most
#     [TOTAL_TIME time]       of all scenes together: 90s, 10min
#     [SKIP no-device|undecided|both|none]
#     [ARGS argument...])     further ones of `tandem verify`
#
# Adds a CTest test that passes where `tandem verify` shows the images to agree, and fails where they disagree or the
# candidate fails. Two of the program's statuses are neither:
#   4, no usable Vulkan device: the test is skipped. SKIP none, for a driver's own gate, fails it.
#   3, undecided in the time: the test fails, since nothing was shown. SKIP undecided and SKIP both skip it.
# CTest tells skipped tests as such (SKIP_RETURN_CODE).
#
# The test works in the project's current source folder, so that a command may name files of it. It writes
# NAME.junit.xml (a case a scene), NAME.json and the folder NAME.report into the current binary folder;
# `tandem-report NAME.report` makes a page of the folder.
function(tandem_add_render_test)
    set(ones NAME PRESET CANDIDATE REFERENCE TIME TOTAL_TIME SKIP)
    cmake_parse_arguments(PARSE_ARGV 0 test "" "${ones}" "SCENE;ARGS")
    if(test_UNPARSED_ARGUMENTS OR test_KEYWORDS_MISSING_VALUES)
        message(FATAL_ERROR "tandem_add_render_test: unknown or without a value: "
            "${test_UNPARSED_ARGUMENTS}${test_KEYWORDS_MISSING_VALUES}; there are ${ones};SCENE;ARGS")
    endif()
    if(NOT test_NAME OR NOT test_NAME MATCHES "^[^/ ]+$")
        message(FATAL_ERROR "tandem_add_render_test: NAME '${test_NAME}' names no files; give one without blanks and slashes")
    endif()
    if(NOT test_SCENE AND NOT test_PRESET)
        message(FATAL_ERROR "tandem_add_render_test: ${test_NAME} has no scene; give SCENE or PRESET")
    endif()
    foreach(scene ${test_SCENE})
        if(scene MATCHES "^[A-Z_]+$")
            message(FATAL_ERROR "tandem_add_render_test: '${scene}' is neither a keyword nor a scene; there are ${ones};SCENE;ARGS")
        endif()
    endforeach()
    set(statuses "no-device=4" "undecided=3" "both=4" "none=")
    if(NOT DEFINED test_SKIP)
        set(test_SKIP no-device)
    endif()
    list(FILTER statuses INCLUDE REGEX "^${test_SKIP}=")
    if(NOT statuses)
        message(FATAL_ERROR "tandem_add_render_test: SKIP '${test_SKIP}' is unknown; give no-device, undecided, both or none")
    endif()
    string(REGEX REPLACE ".*=" "" skipped "${statuses}")

    set(command $<TARGET_FILE:Tandem::tandem> verify ${test_SCENE})
    foreach(option PRESET CANDIDATE REFERENCE TIME TOTAL_TIME)
        if(DEFINED test_${option})
            string(TOLOWER "--${option}" name)
            string(REPLACE "_" "-" name "${name}")
            list(APPEND command ${name} "${test_${option}}")
        endif()
    endforeach()
    set(output ${CMAKE_CURRENT_BINARY_DIR}/${test_NAME})
    list(APPEND command --junit ${output}.junit.xml --json ${output}.json --report ${output}.report ${test_ARGS})
    if(test_SKIP STREQUAL "both")  # CTest knows one such status; a semicolon would end a word of CMake's
        list(PREPEND command sh -c "\"$0\" \"$@\"\nstatus=$?\n[ $status -ne 3 ] || exit 4\nexit $status")
    endif()
    add_test(NAME ${test_NAME} COMMAND ${command} WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
    # The program keeps its own time.
    set_tests_properties(${test_NAME} PROPERTIES TIMEOUT 0)
    if(skipped)
        set_tests_properties(${test_NAME} PROPERTIES SKIP_RETURN_CODE ${skipped})
    endif()
endfunction()
