#include "support/alloc_watch.h"

#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HAS_SANITIZER
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HAS_SANITIZER
#endif

/* One slot per pair of thread and caller. A slot is taken by writing its key, once. */
struct slot {
    _Atomic uint64_t key; /* 0: free */
    _Atomic bool is_named;
    int32_t tid;
    char thread[16];
    const void *caller;
    _Atomic uint64_t n_allocations;
    _Atomic uint64_t n_frees;
    _Atomic uint64_t n_bytes;
};

static struct slot slots[SHEF_ALLOC_WATCH_ENTRIES];
static _Atomic bool watching;

/* Depends on nothing that allocates; the name is read once per slot. */
static struct slot *find_slot(const void *caller)
{
    const int32_t tid = (int32_t)syscall(SYS_gettid);
    /* Return addresses have 48 bits; a collision of two threads' low 16 bits would only mix
     * their counts for one and the same caller. */
    const uint64_t key = (uint64_t)(uintptr_t)caller << 16 | (uint16_t)tid;
    const uint32_t start = (uint32_t)((key * UINT64_C(0x9e3779b97f4a7c15)) >> 55);

    for (uint32_t i = 0; i < SHEF_ALLOC_WATCH_ENTRIES; i++) {
        struct slot *slot = &slots[(start + i) % SHEF_ALLOC_WATCH_ENTRIES];
        uint64_t seen = 0;

        if (atomic_compare_exchange_strong(&slot->key, &seen, key)) {
            slot->tid = tid;
            slot->caller = caller;
            prctl(PR_GET_NAME, slot->thread);
            atomic_store(&slot->is_named, true);
            return slot;
        }
        if (seen == key)
            return slot;
    }
    return &slots[SHEF_ALLOC_WATCH_ENTRIES - 1];
}

/* Only the definitions below use it, and they are left out under a sanitizer. */
__attribute__((unused)) static void note(const void *caller, size_t n_bytes, bool is_free)
{
    const int saved_errno = errno;
    struct slot *slot;

    if (!atomic_load_explicit(&watching, memory_order_relaxed))
        return;
    slot = find_slot(caller);
    atomic_fetch_add(is_free ? &slot->n_frees : &slot->n_allocations, 1);
    atomic_fetch_add(&slot->n_bytes, n_bytes);
    errno = saved_errno;
}

#ifndef HAS_SANITIZER

/* The C library's own definitions, under the names by which it lets itself be wrapped. */
void *__libc_malloc(size_t n_bytes);
void *__libc_calloc(size_t n_items, size_t item_bytes);
void *__libc_realloc(void *block, size_t n_bytes);
void *__libc_memalign(size_t alignment, size_t n_bytes);
void __libc_free(void *block);

void *malloc(size_t n_bytes)
{
    note(__builtin_return_address(0), n_bytes, false);
    return __libc_malloc(n_bytes);
}

void *calloc(size_t n_items, size_t item_bytes)
{
    note(__builtin_return_address(0), n_items * item_bytes, false);
    return __libc_calloc(n_items, item_bytes);
}

void *realloc(void *block, size_t n_bytes)
{
    note(__builtin_return_address(0), n_bytes, false);
    return __libc_realloc(block, n_bytes);
}

void *aligned_alloc(size_t alignment, size_t n_bytes)
{
    note(__builtin_return_address(0), n_bytes, false);
    return __libc_memalign(alignment, n_bytes);
}

void *memalign(size_t alignment, size_t n_bytes);

void *memalign(size_t alignment, size_t n_bytes)
{
    note(__builtin_return_address(0), n_bytes, false);
    return __libc_memalign(alignment, n_bytes);
}

int posix_memalign(void **out_block, size_t alignment, size_t n_bytes)
{
    void *block;

    note(__builtin_return_address(0), n_bytes, false);
    if (alignment % sizeof(void *) != 0 || (alignment & (alignment - 1)) != 0 || alignment == 0)
        return EINVAL;
    block = __libc_memalign(alignment, n_bytes);
    if (!block)
        return ENOMEM;
    *out_block = block;
    return 0;
}

void free(void *block)
{
    if (block)
        note(__builtin_return_address(0), 0, true);
    __libc_free(block);
}

bool shef_alloc_watch_is_available(void)
{
    return true;
}

#else

bool shef_alloc_watch_is_available(void)
{
    return false;
}

#endif

void shef_alloc_watch_start(void)
{
    atomic_store(&watching, false);
    for (int i = 0; i < SHEF_ALLOC_WATCH_ENTRIES; i++) {
        atomic_store(&slots[i].n_allocations, 0);
        atomic_store(&slots[i].n_frees, 0);
        atomic_store(&slots[i].n_bytes, 0);
        atomic_store(&slots[i].is_named, false);
        atomic_store(&slots[i].key, 0);
    }
    atomic_store(&watching, true);
}

void shef_alloc_watch_stop(void)
{
    atomic_store(&watching, false);
}

/* Slots in use, in the order of the table. */
static const struct slot *used_slot(int i)
{
    for (int at = 0; at < SHEF_ALLOC_WATCH_ENTRIES; at++)
        if (atomic_load(&slots[at].is_named) && i-- == 0)
            return &slots[at];
    return NULL;
}

int shef_alloc_watch_count(void)
{
    int n = 0;

    while (used_slot(n))
        n++;
    return n;
}

struct shef_alloc_entry shef_alloc_watch_entry(int i)
{
    const struct slot *slot = used_slot(i);
    struct shef_alloc_entry entry = { .tid = slot->tid,
                                      .caller = slot->caller,
                                      .n_allocations = slot->n_allocations,
                                      .n_frees = slot->n_frees,
                                      .n_bytes = slot->n_bytes };

    memcpy(entry.thread, slot->thread, sizeof entry.thread);
    return entry;
}

bool shef_alloc_watch_is_ours(const void *caller)
{
    Dl_info there, here;

    return dladdr(caller, &there) &&
           dladdr((const void *)(uintptr_t)shef_alloc_watch_start, &here) &&
           there.dli_fbase == here.dli_fbase;
}

uint64_t shef_alloc_watch_calls(const char *thread, bool ours_only)
{
    const int n = shef_alloc_watch_count();
    uint64_t n_calls = 0;

    for (int i = 0; i < n; i++) {
        const struct shef_alloc_entry entry = shef_alloc_watch_entry(i);

        if (thread && strcmp(entry.thread, thread) != 0)
            continue;
        if (!ours_only || shef_alloc_watch_is_ours(entry.caller))
            n_calls += entry.n_allocations + entry.n_frees;
    }
    return n_calls;
}

void shef_alloc_watch_print(FILE *out)
{
    const int n = shef_alloc_watch_count();

    for (int i = 0; i < n; i++) {
        const struct shef_alloc_entry entry = shef_alloc_watch_entry(i);
        Dl_info info = { .dli_fname = "?" };
        ptrdiff_t offset = 0;

        if (dladdr(entry.caller, &info))
            offset = (const char *)entry.caller - (const char *)info.dli_fbase;
        fprintf(out, "%-15s %8llu allocations %8llu frees %10llu bytes  %s+0x%tx %s\n",
                entry.thread, (unsigned long long)entry.n_allocations,
                (unsigned long long)entry.n_frees, (unsigned long long)entry.n_bytes,
                info.dli_fname, offset, info.dli_sname ? info.dli_sname : "");
    }
}
