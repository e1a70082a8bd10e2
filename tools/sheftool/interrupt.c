#include "sheftool/command.h"

#include <signal.h>
#include <stddef.h>

static volatile sig_atomic_t interrupted;

static void on_signal(int number)
{
    (void)number;
    interrupted = 1;
}

bool shef_interrupted(void)
{
    return interrupted != 0;
}

enum shef_err shef_fail_interrupted(struct shef_error *err)
{
    return shef_fail(err, SHEF_ERR_GONE, "stopped by a signal; nothing was written");
}

void shef_interrupt_install(void)
{
    /* SA_RESETHAND: a second Ctrl-C ends the program at once. */
    const struct sigaction action = { .sa_handler = on_signal, .sa_flags = SA_RESETHAND };
    const struct sigaction ignore = { .sa_handler = SIG_IGN };

    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    /* A file beyond the user's limit is a failed write, told and tidied up like any other. */
    sigaction(SIGXFSZ, &ignore, NULL);
}
