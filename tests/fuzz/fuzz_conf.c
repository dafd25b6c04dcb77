/* SPDX-License-Identifier: MIT */
/*
 * fuzz_conf - any bytes as a configuration: no crash, what loads without fault prints to something that does, too, and
 * what --check has no fault with is no fault to the start either, whose pipeline is made where it is small.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "config/conf.h"
#include "daemon/plan_memory.h"
#include "daemon/settings.h"
#include "daemon/wiring.h"

#define MADE_BYTES (64 << 20)

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile size_t sink;

static void note_fault(void *ctx, const char *message)
{
    (void)ctx;
    sink += strlen(message);
}

static void start(const struct conf *conf)
{
    struct plan plan;
    struct pipeline_conf wired;
    struct fault fault;
    double bytes[PLAN_STAGES_MAX];
    plan_make(conf, &plan);
    if (plan_memory(&plan, conf, bytes) > MADE_BYTES)
        return;
    wiring_pipeline(conf, &plan, true, &wired);
    wired.threads = 0;
    struct pipeline *pipeline = pipeline_new(&wired, &fault);
    if (!pipeline)
        abort();
    pipeline_free(pipeline);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct conf conf;
    struct conf_source *source;
    int faults = conf_load_text(&conf, &source, &(struct conf_text){"fuzz", (const char *)data, size},
                                &settings_checks, note_fault, NULL);
    char *printed = NULL;
    size_t printed_size = 0;
    FILE *out = open_memstream(&printed, &printed_size);
    conf_print(&conf, source, out);
    fclose(out);
    conf_source_free(source);
    if (faults == 0) {
        if (conf_load_text(&conf, &source, &(struct conf_text){"printed", printed, printed_size}, &settings_checks,
                           note_fault, NULL) != 0)
            abort();
        conf_source_free(source);
        start(&conf);
    }
    free(printed);
    return 0;
}
