/* Sizes of path buffers: a folder as the user names it, and the longest name we add below it. */
#ifndef SHEFTOOL_PATHS_H
#define SHEFTOOL_PATHS_H

#define SHEF_FOLDER_BYTES 4096
#define SHEF_PATH_BYTES   (SHEF_FOLDER_BYTES + 320)

#endif
