/* Where something stands in a YAML text, for sentences about values that are read but wrong. */
#ifndef SHEFSIM_YAML_LINES_H
#define SHEFSIM_YAML_LINES_H

#include <stddef.h>
#include <stdint.h>

/* The line, counted from 1, of a field of an item of a list of the outermost mapping; of the item
 * if the field is not there; of the list if there is no such item; 1 if there is no such list.
 *   list   NULL: the field of the outermost mapping itself
 *   item   counted from 0 */
int sim_yaml_line(const uint8_t *text, size_t n_bytes, const char *list, int32_t item,
                  const char *field);

#endif
