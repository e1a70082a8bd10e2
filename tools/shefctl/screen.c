#include "shefctl/screen.h"

#include <string.h>
#include <sys/ioctl.h>

/* ECMA-48: to the corner, clear to the end of the line, of the screen. */
#define HOME      "\033[H"
#define END_LINE  "\033[K"
#define END_BELOW "\033[J"

void shef_ctl_screen_size(int fd, int *out_n_rows, int *out_n_columns)
{
    struct winsize size;
    const int is_known = ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_row > 0 && size.ws_col > 0;

    *out_n_rows = is_known ? size.ws_row : 24;
    *out_n_columns = is_known ? size.ws_col : 80;
}

/* Bytes of the first n characters of a line; UTF-8 continuations take no room. */
static int bytes_of(const char *line, int n_line, int n_characters)
{
    int n = 0;

    for (; n < n_line; n++)
        if (((unsigned char)line[n] & 0xc0) != 0x80 && n_characters-- == 0)
            break;
    return n;
}

static int count_lines(const char *text)
{
    int n = 0;

    for (; *text; text++)
        n += *text == '\n';
    return n;
}

void shef_ctl_screen_show(const char *text, int n_rows, int n_columns, FILE *out)
{
    const int n_lines = count_lines(text);
    /* No line end in the last row: it would scroll. */
    const int n_shown = n_lines < n_rows ? n_lines : n_rows > 1 ? n_rows - 1 : 0;

    fputs(HOME, out);
    for (int i = 0; i < n_shown; i++) {
        const int n_line = (int)strcspn(text, "\n");

        fprintf(out, "%.*s" END_LINE "\n", bytes_of(text, n_line, n_columns), text);
        text += n_line + 1;
    }
    if (n_shown < n_lines) {
        char last[64];

        snprintf(last, sizeof last, "... %d more lines; they need a higher window",
                 n_lines - n_shown);
        fprintf(out, "%.*s", n_columns, last);
    }
    fputs(END_BELOW, out);
}
