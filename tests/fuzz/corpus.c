/* SPDX-License-Identifier: MIT */
/*
 * corpus - a fuzz target without a fuzzer: the main of build/tests/corpus_NAME, which hands each file of
 * tests/fuzz/corpus/NAME, and the empty input, to the target once, in the order of their names. So what the fuzzers
 * found stays mended, with no clock and no seed.
 */
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static uint8_t *read_whole(const char *path, size_t *size)
{
    FILE *f = fopen(path, "rb");
    long length;
    uint8_t *data;
    if (!f || fseek(f, 0, SEEK_END) != 0 || (length = ftell(f)) < 0)
        return NULL;
    rewind(f);
    data = malloc((size_t)length + 1);
    *size = data ? fread(data, 1, (size_t)length, f) : 0;
    fclose(f);
    return *size == (size_t)length ? data : NULL;
}

static int no_dot(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

/* The name of the target follows the last "corpus_" of the program's. */
static const char *target_of(const char *program)
{
    const char *name = program;
    for (const char *at; (at = strstr(name, "corpus_"));)
        name = at + strlen("corpus_");
    return name;
}

int main(int argc, char **argv)
{
    const char *name = target_of(argv[0]);
    char path[512];
    struct dirent **file;
    (void)argc;
    snprintf(path, sizeof path, "tests/fuzz/corpus/%s", name);
    int n = scandir(path, &file, no_dot, alphasort);
    if (n <= 0) {
        printf("FAIL corpus_%s: %s has no files\n", name, path);
        return 1;
    }
    LLVMFuzzerTestOneInput((const uint8_t *)"", 0);
    for (int i = 0; i < n; i++) {
        size_t size = 0;
        snprintf(path, sizeof path, "tests/fuzz/corpus/%s/%s", name, file[i]->d_name);
        uint8_t *data = read_whole(path, &size);
        if (!data) {
            printf("FAIL corpus_%s: %s cannot be read\n", name, path);
            return 1;
        }
        printf("# %s\n", path);
        fflush(stdout); /* names the input when the target ends the program */
        LLVMFuzzerTestOneInput(data, size);
        free(data);
        free(file[i]);
    }
    free(file);
    printf("ok corpus_%s\n", name);
    return 0;
}
