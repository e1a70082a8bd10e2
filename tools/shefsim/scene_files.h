/* The files of config/scenes as texts; the build writes them down as C. */
#ifndef SHEFSIM_SCENE_FILES_H
#define SHEFSIM_SCENE_FILES_H

/* Names without ".yaml", in alphabetical order, ended by NULL, and their contents. */
extern const char *const sim_scene_file_names[];
extern const char *const sim_scene_file_texts[];

#endif
