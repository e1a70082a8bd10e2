/* Any bytes as an array file: read whole or refused in a sentence. */
#include <assert.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "shefsim/npy.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    const int fd = memfd_create("npy", 0);
    char path[64];
    struct sim_npy npy;
    struct shef_error err = { .text = "" };

    if (fd < 0 || write(fd, bytes, n_bytes) != (ssize_t)n_bytes)
        return 0;
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    if (sim_npy_open(&npy, path, &err) == SHEF_OK) {
        int64_t n = 1;

        for (int32_t i = 0; i < npy.n_dimensions; i++)
            n *= npy.shape[i];
        /* What it says is there is there, and not a number more. */
        for (int64_t i = 0; i < n; i++) {
            double value;

            assert(sim_npy_read(&npy, 1, &value, &err) == SHEF_OK);
        }
        double beyond;

        assert(sim_npy_read(&npy, 1, &beyond, &err) != SHEF_OK);
        sim_npy_discard(&npy);
    } else {
        assert(err.text[0] != '\0' && !strchr(err.text, '\n'));
    }
    close(fd);
    return 0;
}
