/* SPDX-License-Identifier: MIT */
/*
 * fuzz_conf - any bytes as a configuration: no crash, and what loads without fault prints to something that does, too.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "../../config/conf.h"

static volatile size_t sink;

static void note_fault(void *ctx, const char *message)
{
    (void)ctx;
    sink += strlen(message);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct conf conf;
    struct conf_source *source;
    int faults = conf_load_text(&conf, &source, "fuzz", (const char *)data, size, NULL, note_fault, NULL);
    char *printed = NULL;
    size_t printed_size = 0;
    FILE *out = open_memstream(&printed, &printed_size);
    conf_print(&conf, source, out);
    fclose(out);
    conf_source_free(source);
    if (faults == 0) {
        if (conf_load_text(&conf, &source, "printed", printed, printed_size, NULL, note_fault, NULL) != 0)
            abort();
        conf_source_free(source);
    }
    free(printed);
    return 0;
}
