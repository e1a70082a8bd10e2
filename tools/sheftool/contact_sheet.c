#include "sheftool/contact_sheet.h"

#include <stdio.h>

#include "core/memory.h"
#include "sheftool/picture.h"

#define GAP_PX    10
#define TITLE_PX  34
#define LABEL_PX  22 /* two lines of 8 px and air */
#define LETTER_PX 6

static const struct shef_rgb8 paper = { 36, 38, 42 };
static const struct shef_rgb8 ink = { 235, 235, 235 };
static const struct shef_rgb8 faint_ink = { 170, 172, 176 };

static void fill(struct shef_image_rgb8 picture, int32_t x0, int32_t y0, int32_t w, int32_t h,
                 struct shef_rgb8 colour)
{
    for (int32_t y = y0; y < y0 + h; y++)
        for (int32_t x = x0; x < x0 + w; x++)
            shef_row_rgb8(picture, y)[x] = colour;
}

void shef_contact_sheet_corner(const struct shef_contact_sheet *sheet, int32_t column, int32_t row,
                               int32_t *out_x, int32_t *out_y)
{
    *out_x = GAP_PX + column * (sheet->cell_width_px + GAP_PX);
    *out_y = TITLE_PX + LABEL_PX + row * (sheet->cell_height_px + LABEL_PX + GAP_PX);
}

enum shef_err shef_contact_sheet_create(struct shef_contact_sheet *out_sheet, int32_t n_columns,
                                        int32_t n_rows, int32_t cell_width_px,
                                        int32_t cell_height_px, const char *title,
                                        struct shef_error *err)
{
    struct shef_contact_sheet sheet = {
        .n_columns = n_columns,
        .n_rows = n_rows,
        .cell_width_px = cell_width_px,
        .cell_height_px = cell_height_px,
    };
    int32_t width_px;
    int32_t height_px;

    shef_contact_sheet_corner(&sheet, n_columns, n_rows, &width_px, &height_px);
    height_px -= LABEL_PX;

    const enum shef_err code = shef_image_create_rgb8(&sheet.picture, width_px, height_px, err);

    if (code != SHEF_OK)
        return code;
    fill(sheet.picture, 0, 0, width_px, height_px, paper);
    for (int32_t row = 0; row < n_rows; row++)
        for (int32_t column = 0; column < n_columns; column++) {
            int32_t x;
            int32_t y;

            shef_contact_sheet_corner(&sheet, column, row, &x, &y);
            fill(sheet.picture, x, y, cell_width_px, cell_height_px, (struct shef_rgb8){ 0, 0, 0 });
        }
    shef_picture_draw_text(sheet.picture, GAP_PX, GAP_PX, 2, ink, title);
    *out_sheet = sheet;
    return SHEF_OK;
}

void shef_contact_sheet_destroy(struct shef_contact_sheet *sheet)
{
    shef_image_destroy_rgb8(&sheet->picture);
}

void shef_contact_sheet_label(const struct shef_contact_sheet *sheet, int32_t column, int32_t row,
                              const char *first_line, const char *second_line)
{
    const int n_letters = sheet->cell_width_px / LETTER_PX;
    char line[256];
    int32_t x;
    int32_t y;

    shef_contact_sheet_corner(sheet, column, row, &x, &y);
    snprintf(line, sizeof line, "%.*s", n_letters, first_line);
    shef_picture_draw_text(sheet->picture, x, y - LABEL_PX + 2, 1, ink, line);
    snprintf(line, sizeof line, "%.*s", n_letters, second_line);
    shef_picture_draw_text(sheet->picture, x, y - LABEL_PX + 12, 1, faint_ink, line);
}
