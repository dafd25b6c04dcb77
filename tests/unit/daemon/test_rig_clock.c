/* SPDX-License-Identifier: MIT */
/* test_rig_clock - the computer's clock is set while a capture is made: the capture says when and by how much. */
#include "tests/lib/rig.h"

#include <dirent.h>

#include "drivers/capture/mcap.h"

#define SCENE     "cylinder 5 0 0.5\n"
#define NOTES_MAX 64

struct note {
    unsigned segment;
    uint64_t log_ns;
    int64_t ahead_ns, was_ahead_ns;
};

static char folder[64];
static struct note notes[NOTES_MAX];
static unsigned n_notes, n_segments;

static void begin(uint64_t file_size)
{
    snprintf(folder, sizeof folder, "/tmp/sonard-rig-XXXXXX");
    CHECK(mkdtemp(folder) != NULL);
    rig_captures = folder;
    rig_file_size = file_size;
    rig_start(SCENE, "");
}

static void take_note(const struct mcap_message *m)
{
    json_t *json = json_loadb((const char *)m->data, m->size, 0, NULL);
    const json_t *ahead = json_object_get(json, "ahead_ns"), *was = json_object_get(json, "was_ahead_ns");
    CHECK(json_is_integer(ahead) && json_is_integer(was) && n_notes < NOTES_MAX);
    if (n_notes < NOTES_MAX)
        notes[n_notes++] =
            (struct note){n_segments, m->log_ns, json_integer_value(ahead), json_integer_value(was)};
    json_decref(json);
}

/* All notes of a segment, which is removed. */
static void read_segment(const char *path)
{
    struct fault fault = {""};
    struct mcap_message m;
    struct mcap_reader *r = mcap_open(path, NULL, NULL, &fault);
    CHECK_STR(fault.text, "");
    while (r && mcap_next(r, &m))
        if (strcmp(m.channel->topic, "/clock") == 0)
            take_note(&m);
    mcap_close(r);
    CHECK(unlink(path) == 0);
    n_segments++;
}

/* Of all segments, in their order. */
static void end_and_read(void)
{
    struct dirent **entry = NULL;
    rig_end();
    rig_captures = NULL;
    n_notes = n_segments = 0;
    const int n = scandir(folder, &entry, NULL, alphasort);
    for (int i = 0; i < n; i++) {
        char path[400];
        snprintf(path, sizeof path, "%s/%s", folder, entry[i]->d_name);
        if (entry[i]->d_name[0] != '.')
            read_segment(path);
        free(entry[i]);
    }
    free(entry);
    CHECK(rmdir(folder) == 0);
}

TEST(a_clock_that_is_never_set_makes_no_note)
{
    begin(1u << 30);
    for (int i = 0; i < 10; i++) {
        rig_run(1);
        rig.clock_off_ns += 1000000; /* that much is no step */
    }
    rig.clock_off_ns = 0;
    end_and_read();
    CHECK_INT(n_notes, 0);
    CHECK_INT(n_segments, 1);
}

TEST(each_step_is_noted_where_it_happened)
{
    const int64_t ahead_ns[] = {56ll * 365 * 86400 * RIG_S, 56ll * 365 * 86400 * RIG_S - 2 * (int64_t)RIG_S, 0};
    uint64_t set_ns[3];
    begin(1u << 30);
    for (int i = 0; i < 3; i++) {
        rig_run(3);
        set_ns[i] = RIG_EPOCH_NS + rig_now_ns;
        rig.clock_off_ns = ahead_ns[i];
    }
    rig_run(3);
    end_and_read();
    CHECK_INT(n_notes, 3);
    for (unsigned i = 0; i < 3 && n_notes == 3; i++) {
        CHECK_INT(notes[i].ahead_ns, ahead_ns[i]);
        CHECK_INT(notes[i].was_ahead_ns, i > 0 ? ahead_ns[i - 1] : 0);
        CHECK(notes[i].log_ns >= set_ns[i] && notes[i].log_ns - set_ns[i] <= RIG_S);
    }
}

static uint64_t segments_begun(void)
{
    struct record_status status;
    record_status(rig.d.record, &status);
    return status.segments.segments;
}

/* Each can be read alone. */
TEST(later_segments_say_it_again)
{
    begin(1);
    rig_run(1);
    rig.clock_off_ns = 5 * (int64_t)RIG_S;
    rig_run(2);
    const uint64_t begun = segments_begun();
    for (int i = 0; i < 60000 && segments_begun() < begun + 2; i++) {
        rig_run(1);
        usleep(1000); /* the thread that writes goes by no clock of ours */
    }
    rig_run(2);
    end_and_read();
    CHECK(n_segments >= 2 && n_notes >= 2);
    CHECK(notes[0].ahead_ns == 5 * (int64_t)RIG_S && notes[0].was_ahead_ns == 0);
    CHECK(notes[n_notes - 1].segment > notes[0].segment);
    for (unsigned i = 1; i < n_notes; i++) {
        CHECK_INT(notes[i].ahead_ns, 5 * (int64_t)RIG_S);
        CHECK_INT(notes[i].was_ahead_ns, notes[i].ahead_ns);
    }
}

int main(void)
{
    RUN(a_clock_that_is_never_set_makes_no_note);
    RUN(each_step_is_noted_where_it_happened);
    RUN(later_segments_say_it_again);
    return test_end();
}
