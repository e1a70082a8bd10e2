#include "support/support.h"

#include <assert.h>
#include <dirent.h>
#include <ftw.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define DEFAULT_SEED 20211001u /* the paper's conference, IROS 2021 */

void setUp(void);
void tearDown(void);

__attribute__((weak)) void setUp(void)
{
}

__attribute__((weak)) void tearDown(void)
{
}

static int is_folder(const char *path)
{
    struct stat info;

    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

const char *shef_test_data(const char *name)
{
    static char path[PATH_MAX];
    const char *root = getenv("SHEF_DATA");

    if (root && *root)
        snprintf(path, sizeof path, "%s/%s", root, name);
    else
        snprintf(path, sizeof path, "%s/../shared/data/%s", SHEF_SOURCE_DIR, name);
    return is_folder(path) ? path : NULL;
}

const char *shef_test_source(const char *path)
{
    static char full[PATH_MAX];

    snprintf(full, sizeof full, "%s/%s", SHEF_SOURCE_DIR, path);
    return full;
}

static char temp_folder[PATH_MAX];

static int remove_entry(const char *path, const struct stat *info, int type, struct FTW *at)
{
    (void)info;
    (void)type;
    (void)at;
    return remove(path);
}

static void remove_temp_folder(void)
{
    nftw(temp_folder, remove_entry, 8, FTW_DEPTH | FTW_PHYS);
}

const char *shef_test_temp_folder(void)
{
    if (temp_folder[0] == '\0') {
        const char *parent = getenv("TMPDIR");

        snprintf(temp_folder, sizeof temp_folder, "%s/shef-test-XXXXXX", parent ? parent : "/tmp");
        if (!mkdtemp(temp_folder)) {
            perror(temp_folder);
            abort();
        }
        atexit(remove_temp_folder);
    }
    return temp_folder;
}

const char *shef_test_temp_path(const char *name)
{
    static char paths[4][2 * PATH_MAX];
    static unsigned next;
    char *path = paths[next++ % 4];

    snprintf(path, sizeof paths[0], "%s/%s", shef_test_temp_folder(), name);
    return path;
}

int shef_test_temp_count(void)
{
    DIR *folder = opendir(shef_test_temp_folder());
    int n_entries = 0;

    assert(folder);
    for (const struct dirent *entry; (entry = readdir(folder));)
        n_entries += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(folder);
    return n_entries;
}

struct shef_test_random shef_test_random_start(void)
{
    const char *wanted = getenv("SHEF_TEST_SEED");
    const uint64_t seed = wanted ? strtoull(wanted, NULL, 0) : DEFAULT_SEED;

    printf("random seed %" PRIu64 " (SHEF_TEST_SEED=%" PRIu64 " repeats it)\n", seed, seed);
    return (struct shef_test_random){ .state = seed };
}

/* SplitMix64: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014. */
uint64_t shef_test_random_u64(struct shef_test_random *random)
{
    uint64_t z = random->state += UINT64_C(0x9e3779b97f4a7c15);

    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

int32_t shef_test_random_range(struct shef_test_random *random, int32_t first, int32_t last)
{
    assert(first <= last);

    const uint64_t n_values = (uint64_t)((int64_t)last - first + 1);

    /* The modulo's bias is below 2^-32, far under anything that a test could see. */
    return (int32_t)(first + (int64_t)(shef_test_random_u64(random) % n_values));
}

double shef_test_random_unit(struct shef_test_random *random)
{
    return (double)(shef_test_random_u64(random) >> 11) * 0x1p-53;
}
