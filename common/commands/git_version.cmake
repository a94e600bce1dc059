# Writes ${output}: git_version() as C++, with the commit of ${source} as it is built; only where it has changed.
find_package(Git QUIET)
set(version "unknown")
if(Git_FOUND)
    execute_process(COMMAND ${GIT_EXECUTABLE} -C ${source} describe --always --exclude * --dirty --abbrev=12
        OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
    if(NOT failed)
        set(version ${found})
    endif()
endif()
# Without command.h, which would take seconds after each commit.
set(text "#include <string>\n\nnamespace tandem {\nstd::string git_version() { return \"${version}\"; }\n}\n")
if(EXISTS ${output})
    file(READ ${output} old)
endif()
if(NOT "${old}" STREQUAL "${text}")
    file(WRITE ${output} "${text}")
endif()
