# Finds Unity, the C test framework, and defines unity::framework.
#
# Looked for in this order:
#   1. UNITY_ROOT: a folder that holds unity.c and unity.h (also as src/unity.c)
#   2. an installed CMake package
#   3. the cache that tools/fetch-unity fills: $SHEF_CACHE, else $XDG_CACHE_HOME/shef, else
#      ~/.cache/shef; then build/cache of this checkout
#   4. upstream's release at a pinned tag, only with -DSHEF_DOWNLOAD_UNITY=ON
# Unity_FOUND tells the result; nothing here is fatal.

set(UNITY_ROOT "" CACHE PATH "Folder with unity.c and unity.h; empty: look elsewhere")
option(SHEF_DOWNLOAD_UNITY "Let CMake download Unity's release if it is found nowhere" OFF)

if(DEFINED ENV{SHEF_CACHE})
    set(unity_cache $ENV{SHEF_CACHE})
elseif(DEFINED ENV{XDG_CACHE_HOME})
    set(unity_cache $ENV{XDG_CACHE_HOME}/shef)
else()
    set(unity_cache $ENV{HOME}/.cache/shef)
endif()

if(NOT TARGET unity::framework AND NOT UNITY_ROOT)
    find_package(unity CONFIG QUIET)
endif()

if(NOT TARGET unity::framework)
    if(UNITY_ROOT)
        set(unity_folders ${UNITY_ROOT})
    else()
        set(unity_folders ${unity_cache}/unity ${PROJECT_SOURCE_DIR}/build/cache/unity)
    endif()
    find_path(unity_folder unity.c PATHS ${unity_folders} PATH_SUFFIXES src
              NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH NO_CACHE)
    if(NOT unity_folder AND NOT UNITY_ROOT AND SHEF_DOWNLOAD_UNITY)
        include(FetchContent)
        # SOURCE_SUBDIR names a folder without a CMakeLists.txt: only the sources are wanted.
        FetchContent_Declare(unity GIT_REPOSITORY https://github.com/ThrowTheSwitch/Unity.git
                             GIT_TAG v2.5.2 GIT_SHALLOW ON SOURCE_SUBDIR src)
        FetchContent_MakeAvailable(unity)
        set(unity_folder ${unity_SOURCE_DIR}/src)
    endif()
    if(unity_folder)
        add_library(shef_unity STATIC ${unity_folder}/unity.c)
        target_include_directories(shef_unity SYSTEM PUBLIC ${unity_folder})
        target_compile_definitions(shef_unity PUBLIC UNITY_INCLUDE_DOUBLE)
        add_library(unity::framework ALIAS shef_unity)
    endif()
endif()

if(TARGET unity::framework)
    set(Unity_FOUND TRUE)
else()
    set(Unity_FOUND FALSE)
endif()
