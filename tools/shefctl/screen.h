/* One look at changing values on a terminal: in place of the look before, cut to the window, so
 * that the beginning stays in sight however small it is. Thread: main. */
#ifndef SHEFCTL_SCREEN_H
#define SHEFCTL_SCREEN_H

#include <stdio.h>

/* The window of the terminal at fd; 24 rows of 80 columns where it does not say. */
void shef_ctl_screen_size(int fd, int *out_n_rows, int *out_n_columns);

/* Shows text from the top left corner on; what lies beyond the last column or row is left out, and
 * the last row says how many lines are missing.
 *   text  lines of UTF-8 without other control characters */
void shef_ctl_screen_show(const char *text, int n_rows, int n_columns, FILE *out);

#endif
