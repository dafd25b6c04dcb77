/* SPDX-License-Identifier: MIT */
/* test_source_event - what befalls a sonar comes out of a capture as it went in; nothing else is taken. */
#include "daemon/input/source_event.h"

#include <string.h>

#include "grid/geometry.h"
#include "tests/lib/test.h"

static struct source_event again(const struct source_event *event)
{
    char text[SOURCE_EVENT_TEXT_MAX];
    struct source_event out = {0};
    struct fault fault;
    const size_t n = source_event_write(event, text);
    CHECK_INT(n, strlen(text));
    CHECK(source_event_read(text, n, &out, &fault));
    CHECK_INT(out.kind, event->kind);
    return out;
}

TEST(each_kind_is_read_back)
{
    static const enum source_event_kind plain[] = {SOURCE_OPENED, SOURCE_CLOSED, SOURCE_TICK};
    for (size_t i = 0; i < sizeof plain / sizeof *plain; i++)
        again(&(struct source_event){.kind = plain[i]});
    const struct source_event looks =
        again(&(struct source_event){.kind = SOURCE_LOOKS, .from_rad = 0.1, .to_rad = GEO_TURN / 3, .only = true});
    CHECK(looks.from_rad == 0.1 && looks.to_rad == GEO_TURN / 3 && looks.only); /* to the bit */
}

TEST(each_state_is_read_back)
{
    for (enum device_state state = DEVICE_CLOSED; state <= DEVICE_SILENT; state++) {
        const struct source_event out =
            again(&(struct source_event){.kind = SOURCE_STATE, .open = true, .state = state});
        CHECK(out.open && out.state == state);
    }
    CHECK(!again(&(struct source_event){.kind = SOURCE_STATE, .open = false, .state = DEVICE_RUNNING}).open);
}

TEST(nothing_else_is_taken)
{
    static const char *const wrong[] = {
        "",
        "tick",
        "[]",
        "{}",
        "{\"event\":1}",
        "{\"event\":\"bang\"}",
        "{\"event\":\"state\"}",
        "{\"event\":\"state\",\"state\":\"asleep\"}",
        "{\"event\":\"looks\"}",
        "{\"event\":\"looks\",\"from_rad\":0,\"to_rad\":1}",
        "{\"event\":\"looks\",\"from_rad\":0,\"to_rad\":1e300,\"only\":true}",
        "{\"event\":\"looks\",\"from_rad\":\"0\",\"to_rad\":1,\"only\":true}",
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct source_event out;
        struct fault fault = {""};
        CHECK(!source_event_read(wrong[i], strlen(wrong[i]), &out, &fault));
        CHECK(fault.text[0] != '\0');
    }
}

int main(void)
{
    RUN(each_kind_is_read_back);
    RUN(each_state_is_read_back);
    RUN(nothing_else_is_taken);
    return test_end();
}
