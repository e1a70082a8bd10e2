# Language level, warnings and the naming rules that the whole tree builds by.

set(CMAKE_C_STANDARD 11)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)

# Assertions state what our own code promises itself. They stay on in every build.
set(CMAKE_C_FLAGS_RELEASE "-O3")
set(CMAKE_CXX_FLAGS_RELEASE "-O3")
set(CMAKE_C_FLAGS_DEBUG "-Og -g")
set(CMAKE_CXX_FLAGS_DEBUG "-Og -g")

find_program(CCACHE ccache)
if(CCACHE)
    # Where its folder cannot be written, ccache fails instead of compiling.
    execute_process(COMMAND ${CCACHE} --get-config cache_dir OUTPUT_VARIABLE ccache_folder
                    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    execute_process(COMMAND mkdir -p ${ccache_folder}/tmp ERROR_QUIET)
    execute_process(COMMAND test -w ${ccache_folder}/tmp RESULT_VARIABLE ccache_refused)
    if(NOT ccache_refused)
        set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE})
        set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
    endif()
endif()

find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
if(NOT SHEF_KERNEL_CHECKS_ONLY)
    find_package(PNG REQUIRED)
endif()

add_library(shef_flags INTERFACE)
target_compile_definitions(shef_flags INTERFACE _GNU_SOURCE)
# No fused multiply-add: every instruction set rounds like the C reference.
target_compile_options(shef_flags INTERFACE
    -Wall -Wextra -Werror -Wshadow -Wpointer-arith -Wcast-qual -Wvla -Wwrite-strings
    -Wno-missing-field-initializers -ffp-contract=off -fno-math-errno -fno-trapping-math
    $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes>)
target_link_libraries(shef_flags INTERFACE Threads::Threads m)
if(SHEF_SANITIZE)
    target_compile_options(shef_flags INTERFACE
        -fsanitize=${SHEF_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(shef_flags INTERFACE -fsanitize=${SHEF_SANITIZE})
    if(SHEF_SANITIZE MATCHES "thread")
        # GCC expands small copies after it has instrumented the code; as calls they are seen.
        target_compile_options(shef_flags INTERFACE
            -fno-builtin-memcpy -fno-builtin-memmove -fno-builtin-memset)
    endif()
endif()

# Adds a static library of every source file in the folder and, under kernels/, of those that
# this processor family can compile: NAME_avx2.c, NAME_avx512.c and NAME_neon.c get their
# instruction set from their name, and are picked at run time.
function(shef_add_library name)
    file(GLOB sources CONFIGURE_DEPENDS *.c *.cpp kernels/*.c)
    if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
        list(FILTER sources EXCLUDE REGEX "_neon\\.c$")
    else()
        list(FILTER sources EXCLUDE REGEX "_avx(2|512)\\.c$")
    endif()
    foreach(source ${sources})
        if(source MATCHES "_avx2\\.c$")
            set_source_files_properties(${source} PROPERTIES COMPILE_OPTIONS "-mavx2")
        elseif(source MATCHES "_avx512\\.c$")
            set_source_files_properties(${source} PROPERTIES COMPILE_OPTIONS
                "-mavx512f;-mavx512bw;-mavx512vl;-mavx512dq;-mprefer-vector-width=512")
        endif()
    endforeach()
    add_library(${name} STATIC ${sources})
    target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR}/firmware_service)
    target_link_libraries(${name} PUBLIC shef_flags)
endfunction()
