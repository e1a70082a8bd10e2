/* A grid of labelled thumbnails in one picture. Thread: one per sheet. */
#ifndef SHEFTOOL_CONTACT_SHEET_H
#define SHEFTOOL_CONTACT_SHEET_H

#include "core/error.h"
#include "core/image.h"

struct shef_contact_sheet {
    struct shef_image_rgb8 picture; /* owned */
    int32_t n_columns;
    int32_t n_rows;
    int32_t cell_width_px; /* of a thumbnail, without label and gap */
    int32_t cell_height_px;
};

/* A dark grey sheet with black cells and a title.
 *   title  one line of ASCII */
SHEF_MUST_CHECK enum shef_err shef_contact_sheet_create(struct shef_contact_sheet *out_sheet,
                                                        int32_t n_columns, int32_t n_rows,
                                                        int32_t cell_width_px,
                                                        int32_t cell_height_px, const char *title,
                                                        struct shef_error *err);

void shef_contact_sheet_destroy(struct shef_contact_sheet *sheet);

/* The corner of a cell's thumbnail in the picture. */
void shef_contact_sheet_corner(const struct shef_contact_sheet *sheet, int32_t column, int32_t row,
                               int32_t *out_x, int32_t *out_y);

/* Writes two lines above a cell; what does not fit is cut. */
void shef_contact_sheet_label(const struct shef_contact_sheet *sheet, int32_t column, int32_t row,
                              const char *first_line, const char *second_line);

#endif
