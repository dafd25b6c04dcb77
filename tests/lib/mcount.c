/* SPDX-License-Identifier: MIT */
/*
 * mcount - counts the calls of the malloc family in a program it is preloaded into. It knows nothing of the program.
 *
 *   LD_PRELOAD=build/tests/mcount.so PROGRAM
 *
 * SIGUSR2 writes "mcount: allocations A frees F" to standard error, counted since the signal before (or the start),
 * and counts from 0 again: send it when the program is ready and once more when it has worked for a while. The exit
 * writes the same line. MCOUNT_OUT=FILE appends the lines there instead; MCOUNT_ABORT=1 aborts at the first
 * allocation after the first signal, with the guilty call on the stack.
 *
 * A program may ask by itself: `extern unsigned long mcount_allocations(void) __attribute__((weak));` is null when
 * this library is not loaded.
 */
#include <errno.h>
#include <fcntl.h>
#include <malloc.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* glibc's own names for what is replaced here: no dlsym(), which allocates itself. */
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);
extern void __libc_free(void *p);

static atomic_ulong allocations, frees;
static atomic_bool armed; /* abort at an allocation */
static bool abort_wanted;
static int out = STDERR_FILENO;

unsigned long mcount_allocations(void)
{
    return atomic_load(&allocations);
}

unsigned long mcount_frees(void)
{
    return atomic_load(&frees);
}

static void count_allocation(void)
{
    atomic_fetch_add(&allocations, 1);
    if (atomic_load(&armed))
        abort();
}

static char *put_text(char *at, const char *text)
{
    size_t n = strlen(text);
    memcpy(at, text, n);
    return at + n;
}

static char *put_number(char *at, unsigned long value)
{
    char digits[24];
    int n = 0;
    do
        digits[n++] = (char)('0' + value % 10);
    while ((value /= 10) != 0);
    while (n > 0)
        *at++ = digits[--n];
    return at;
}

/* Only what is safe in a signal handler. */
static void report(void)
{
    char line[96], *at = line;
    at = put_text(at, "mcount: allocations ");
    at = put_number(at, atomic_exchange(&allocations, 0));
    at = put_text(at, " frees ");
    at = put_number(at, atomic_exchange(&frees, 0));
    at = put_text(at, "\n");
    ssize_t written = write(out, line, (size_t)(at - line));
    (void)written;
}

static void on_signal(int signal)
{
    int saved = errno;
    (void)signal;
    report();
    atomic_store(&armed, abort_wanted);
    errno = saved;
}

__attribute__((constructor)) static void mcount_begin(void)
{
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART};
    const char *path = getenv("MCOUNT_OUT"), *wanted = getenv("MCOUNT_ABORT");
    if (path != NULL) {
        int fd = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
        if (fd >= 0)
            out = fd;
    }
    abort_wanted = wanted != NULL && strcmp(wanted, "1") == 0;
    sigaction(SIGUSR2, &action, NULL);
}

__attribute__((destructor)) static void mcount_end(void)
{
    atomic_store(&armed, false); /* what libraries do at exit is nobody's fault */
    report();
}

void *malloc(size_t size)
{
    count_allocation();
    return __libc_malloc(size);
}

void *calloc(size_t n, size_t size)
{
    count_allocation();
    return __libc_calloc(n, size);
}

void *realloc(void *old, size_t size)
{
    count_allocation();
    return __libc_realloc(old, size);
}

void *memalign(size_t alignment, size_t size)
{
    count_allocation();
    return __libc_memalign(alignment, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
    return memalign(alignment, size);
}

void *valloc(size_t size)
{
    return memalign((size_t)sysconf(_SC_PAGESIZE), size);
}

int posix_memalign(void **result, size_t alignment, size_t size)
{
    if (alignment % sizeof(void *) != 0 || alignment == 0 || (alignment & (alignment - 1)) != 0)
        return EINVAL;
    void *p = memalign(alignment, size);
    if (p == NULL)
        return ENOMEM;
    *result = p;
    return 0;
}

void free(void *p)
{
    atomic_fetch_add(&frees, p != NULL);
    __libc_free(p);
}
