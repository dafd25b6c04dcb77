/* SPDX-License-Identifier: MIT */
/* map_file and map_export against maps that are made here: what goes in comes out, and nothing else is accepted. */
#include <unistd.h>
#include <zlib.h>

#include "core/fault.h"
#include "daemon/map/map_export.h"
#include "daemon/map/map_file.h"
#include "core/atomic_file.h"
#include "drivers/capture/mcap.h"
#include "tests/lib/voxmap_rig.h"

static const struct voxmap_setting setting = {.voxel_m = 0.2, .height = 80, .keep_echoes = true};

static const struct map_origin nowhere = {.run = 7};

/* A file with pages of these sizes, filled with their number. */
static struct map_bytes file_of(const size_t *size, int n)
{
    struct map_bytes b;
    CHECK(map_file_begin(&b, &setting, &nowhere));
    for (int i = 0; i < n; i++) {
        uint8_t *room = map_file_room(&b, size[i] + 10);
        CHECK(room != NULL);
        memset(room, i, size[i]);
        map_file_take(&b, size[i]);
    }
    CHECK(map_file_end(&b, NULL, 0));
    return b;
}

static void seal(struct map_bytes *b)
{
    const uint32_t sum = (uint32_t)crc32(0, b->bytes, (uInt)(b->size - 4));
    for (int i = 0; i < 4; i++)
        b->bytes[b->size - 4 + (size_t)i] = (uint8_t)(sum >> (8 * i));
}

TEST(pages_come_back)
{
    static const size_t size[] = {5, 0, 1000};
    struct map_bytes b = file_of(size, 3);
    struct map_page page = {0};
    struct fault fault = {""};
    uint32_t n = 9, seen = 0;
    CHECK_INT(map_file_check(b.bytes, b.size, &setting, &n, &fault), MAP_GOOD);
    CHECK_INT(n, 3);
    for (; map_file_page(b.bytes, b.size, &page); seen++) {
        CHECK_INT(page.size, size[seen]);
        for (size_t i = 0; i < page.size; i++)
            CHECK_INT(page.bytes[i], seen);
    }
    CHECK_INT(seen, 3);
    free(b.bytes);
}

TEST(an_empty_map_is_a_map)
{
    struct map_bytes b = file_of(NULL, 0);
    struct map_page page = {0};
    struct fault fault = {""};
    uint32_t n = 9;
    CHECK_INT(map_file_check(b.bytes, b.size, &setting, &n, &fault), MAP_GOOD);
    CHECK_INT(n, 0);
    CHECK(!map_file_page(b.bytes, b.size, &page));
    free(b.bytes);
}

/* What places count from comes back; a map of version 1 has none, one of version 2 no residual, and their submaps are
 * found all the same. */
TEST(the_origin_is_in_the_file)
{
    const struct map_origin here = {.run = 1763703962123456789, .name = "geo:41.1784,-8.6071"};
    static const size_t size[] = {5, 300};
    struct map_bytes b = {0};
    struct fault fault = {""};
    uint32_t n = 9;
    CHECK(map_file_begin(&b, &setting, &here) && map_file_end(&b, NULL, 0));
    CHECK_INT(map_file_check(b.bytes, b.size, &setting, &n, &fault), MAP_GOOD);
    struct map_origin got = map_file_origin(b.bytes);
    CHECK(got.run == here.run);
    CHECK_STR(got.name, here.name);
    memset(b.bytes + 40, 'x', MAP_ORIGIN_MAX); /* no NUL, from outside */
    got = map_file_origin(b.bytes);
    CHECK_INT(strlen(got.name), MAP_ORIGIN_MAX - 1);
    free(b.bytes);

    struct map_page page = {0};
    b = file_of(size, 2);
    b.size -= 8; /* the residual's */
    b.bytes[8] = 2;
    seal(&b);
    CHECK_INT(map_file_check(b.bytes, b.size, &setting, &n, &fault), MAP_GOOD);
    CHECK(map_file_origin(b.bytes).run == nowhere.run && map_file_residual(b.bytes, b.size, &n) == NULL);
    memmove(b.bytes + 32, b.bytes + 96, b.size - 96);
    b.size -= 64;
    b.bytes[8] = 1;
    seal(&b);
    CHECK_INT(map_file_check(b.bytes, b.size, &setting, &n, &fault), MAP_GOOD);
    CHECK_INT(n, 2);
    CHECK(map_file_page(b.bytes, b.size, &page) && page.size == 5);
    CHECK(map_file_page(b.bytes, b.size, &page) && page.size == 300 && page.bytes[299] == 1);
    CHECK(!map_file_page(b.bytes, b.size, &page));
    got = map_file_origin(b.bytes);
    CHECK(got.run == 0 && !got.name[0]);
    free(b.bytes);
}

TEST(the_residual_comes_back)
{
    static uint8_t residual[4096];
    static const size_t size[] = {5, 300};
    struct fault fault = {""};
    uint32_t n = 9;
    for (size_t i = 0; i < sizeof residual; i++)
        residual[i] = (uint8_t)(7 * i);
    struct map_bytes b = file_of(size, 2);
    CHECK(map_file_residual(b.bytes, b.size, &n) == NULL && n == 0);
    b.size -= 12;
    CHECK(map_file_end(&b, residual, sizeof residual));
    CHECK_INT(map_file_check(b.bytes, b.size, &setting, &n, &fault), MAP_GOOD);
    CHECK_INT(n, 2);
    const uint8_t *got = map_file_residual(b.bytes, b.size, &n);
    CHECK(n == sizeof residual && memcmp(got, residual, n) == 0);
    b.size -= 4 + 1; /* one count fewer is no table */
    b.bytes[b.size - 4095 - 8 + 1] = 0x0f;
    b.bytes[b.size - 4095 - 8] = 0xff;
    b.size += 4;
    seal(&b);
    CHECK_INT(map_file_check(b.bytes, b.size, &setting, &n, &fault), MAP_DAMAGED);
    free(b.bytes);
}

TEST(every_damage_is_found)
{
    static const size_t size[] = {40, 30};
    struct map_bytes b = file_of(size, 2);
    struct fault fault;
    uint32_t n;
    for (size_t i = 0; i < b.size; i++)
        for (int bit = 0; bit < 8; bit++) {
            b.bytes[i] ^= (uint8_t)(1 << bit);
            CHECK(map_file_check(b.bytes, b.size, &setting, &n, &fault) != MAP_GOOD);
            b.bytes[i] ^= (uint8_t)(1 << bit);
        }
    for (size_t cut = 0; cut < b.size; cut++)
        CHECK(map_file_check(b.bytes, cut, &setting, &n, &fault) != MAP_GOOD);
    CHECK_INT(map_file_check(b.bytes, b.size, &setting, &n, &fault), MAP_GOOD);
    free(b.bytes);
}

TEST(what_is_sealed_and_wrong_is_refused)
{
    static const size_t size[] = {40, 30};
    static const struct {
        const char *name;
        size_t at;
        uint8_t value;
        enum map_fault want;
        const char *says;
    } row[] = {
        {"another kind of file", 0, 'X', MAP_FOREIGN, "not a map"},
        {"a newer version", 8, 4, MAP_FOREIGN, "version 4"},
        {"a version that never was", 8, 0, MAP_FOREIGN, "version 0"},
        {"more submaps than there are", 12, 3, MAP_DAMAGED, "damaged"},
        {"fewer submaps than there are", 12, 1, MAP_DAMAGED, "damaged"},
        {"other voxels", 22, 0xd8, MAP_FOREIGN, "0.384375 m"},
        {"another height", 24, 81, MAP_FOREIGN, "81 high"},
        {"no echoes", 28, 0, MAP_FOREIGN, "without echoes"},
        {"a submap longer than the file", 96 + 3, 1, MAP_DAMAGED, "damaged"},
        {"a residual of no size", 96 + 8 + 40 + 8 + 30, 1, MAP_DAMAGED, "damaged"},
        {"a submap of more bytes than any", 96 + 7, 0xff, MAP_DAMAGED, "damaged"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct map_bytes b = file_of(size, 2);
        struct fault fault = {""};
        uint32_t n;
        b.bytes[row[i].at] = row[i].value;
        seal(&b);
        const enum map_fault got = map_file_check(b.bytes, b.size, &setting, &n, &fault);
        if (got != row[i].want || !strstr(fault.text, row[i].says))
            printf("%s: %d, %s\n", row[i].name, (int)got, fault.text);
        CHECK_INT(got, row[i].want);
        CHECK(strstr(fault.text, row[i].says) != NULL);
        free(b.bytes);
    }
}

/* ---- exports: a block of free water with one voxel heard in it ---- */

static struct rig *water(void)
{
    struct voxmap_setting s = rig_setting();
    s.voxel_m = 0.5;
    struct rig *r = rig_new(&s);
    rig_open(r);
    for (int64_t i = 0; i < 4; i++)
        for (int64_t j = 0; j < 5; j++)
            for (int64_t k = 0; k < 6; k++) {
                const bool heard = i == 1 && j == 2 && k == 2;
                rig_set(r, (const int64_t[3]){i - 3, j + 4, k + 10}, heard ? SUBMAP_ECHOES : SUBMAP_VACANCY, 9);
            }
    return r;
}

/* At whole and half steps of the ramp from yellow to violet. */
static bool colour_is(const uint8_t *rgb, double share)
{
    static const int ramp[][3] = {{253, 231, 37}, {94, 201, 98}, {33, 145, 140}, {59, 82, 139}, {68, 1, 84}};
    const int i = (int)(share * 4 + 1e-9);
    const double part = share * 4 - i;
    bool good = true;
    for (int c = 0; c < 3; c++)
        good =
            good && fabs(rgb[c] - ramp[i][c] - (part > 1e-6 ? part * (ramp[i + 1][c] - ramp[i][c]) : 0)) <= 0.51;
    return good;
}

TEST(the_surface_is_by_definition)
{
    struct rig *r = water();
    struct fault fault;
    size_t size, points = 0, echoes = 0;
    uint8_t *ply = map_export_ply(&r->frontier, &size, &fault);
    CHECK(ply != NULL);
    const char *end = ply ? strstr((const char *)ply, "end_header\n") : NULL;
    CHECK(end != NULL);
    const uint8_t *at = (const uint8_t *)end + strlen("end_header\n");
    for (; at + 40 <= ply + size; at += 40, points++) {
        double p[3];
        float n[3];
        memcpy(p, at, sizeof p);
        memcpy(n, at + 24, sizeof n);
        CHECK(p[0] > 2 && p[0] < 4.5 && p[1] > -1.5 && p[1] < 0.5 && p[2] < -5 && p[2] > -8);
        CHECK_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 0, 1e-5);
        echoes += at[36];
        CHECK(colour_is(at + 37, (-p[2] - 5.25) / 2.5)); /* from 5.25 m to 7.75 m deep */
    }
    CHECK(at == ply + size);
    /* 4 x 5 x 6 free less the heard one; inner cells 2 x 3 x 4, of which those around the heard one are surface too */
    CHECK_INT(echoes, 26);
    size_t want = 0;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 5; j++)
            for (int k = 0; k < 6; k++) {
                const bool rim = i == 0 || i == 3 || j == 0 || j == 4 || k == 0 || k == 5;
                const bool near = i <= 2 && j >= 1 && j <= 3 && k >= 1 && k <= 3;
                want += (rim || near) && !(i == 1 && j == 2 && k == 2);
            }
    CHECK_INT(points, want);
    free(ply);
    rig_free(r);
}

TEST(a_normal_points_into_the_water)
{
    struct rig *r = water();
    struct fault fault;
    size_t size;
    uint8_t *ply = map_export_ply(&r->frontier, &size, &fault);
    const uint8_t *at = (const uint8_t *)strstr((const char *)ply, "end_header\n") + strlen("end_header\n");
    double p[3];
    float n[3];
    memcpy(p, at, sizeof p); /* the first: least north, least east, shallowest */
    memcpy(n, at + 24, sizeof n);
    CHECK_NEAR(p[0], 4.5 * 0.5, 0, 1e-12);
    CHECK_NEAR(p[1], -2.5 * 0.5, 0, 1e-12);
    CHECK_NEAR(p[2], -10.5 * 0.5, 0, 1e-12);
    CHECK(n[0] > 0.3f && n[1] > 0.3f && n[2] < -0.3f);
    free(ply);
    rig_free(r);
}

TEST(the_tree_joins_and_counts)
{
    struct rig *r = water();
    struct fault fault;
    size_t size;
    uint8_t *tree = map_export_octomap(&r->mask, &size, &fault);
    CHECK(tree != NULL);
    CHECK(tree && strncmp((const char *)tree, "# Octomap OcTree binary file\n", 29) == 0);
    CHECK(tree && strstr((const char *)tree, "\nres 0.5\ndata\n") != NULL);
    free(tree);
    rig_free(r);
}

TEST(a_map_beyond_the_tree_is_refused)
{
    for (int side = -1; side <= 1; side += 2) {
        struct voxmap_setting s = rig_setting();
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        struct fault fault = {""};
        size_t size;
        rig_aim(&p, (const double[3]){0, side * 5000.0, 0}, 0, 1);
        CHECK(rig_enter(r, &p, 0));
        CHECK(map_export_octomap(&r->mask, &size, &fault) == NULL);
        CHECK(strstr(fault.text, "32768") != NULL);
        rig_free(r);
    }
}

TEST(the_cloud_is_one_message)
{
    struct rig *r = water();
    struct fault fault;
    struct mcap_message m;
    char path[] = "/tmp/sonard-cloud-XXXXXX";
    const int fd = mkstemp(path);
    CHECK(fd >= 0 && map_export_points(&r->frontier, 1500000000123456789u, "test", fd, &fault));
    struct mcap_reader *file = mcap_open(path, NULL, NULL, &fault);
    CHECK(file && mcap_next(file, &m));
    if (!test_case_failed) {
        CHECK_STR(m.channel->topic, "/map/surface");
        CHECK(strncmp((const char *)m.data, "{\"timestamp\":{\"sec\":1500000000,\"nsec\":123456789}", 48) == 0);
        CHECK(memcmp(m.data + m.size - 2, "\"}", 2) == 0);
        CHECK(!mcap_next(file, &m));
    }
    mcap_close(file);
    unlink(path);
    rig_free(r);
}

TEST(no_strangers_file_is_replaced)
{
    char folder[] = "/tmp/sonard-map-XXXXXX", path[64];
    struct fault fault = {""};
    size_t size;
    CHECK(mkdtemp(folder) != NULL);
    snprintf(path, sizeof path, "%s/a", folder);
    CHECK(atomic_file_replace(path, (const uint8_t *)"MAGIC one", 9, 5, &fault));
    CHECK(atomic_file_replace(path, (const uint8_t *)"MAGIC two!", 10, 5, &fault));
    CHECK(!atomic_file_replace(path, (const uint8_t *)"OTHER", 5, 5, &fault));
    CHECK(strstr(fault.text, "not replaced") != NULL);
    uint8_t *bytes = atomic_file_read(path, 100, &size);
    CHECK(bytes && size == 10 && memcmp(bytes, "MAGIC two!", 10) == 0);
    free(bytes);
    bytes = atomic_file_read(path, 4, &size);
    CHECK_INT(size, 5);
    free(bytes);
    fault_set(&fault, "damaged");
    atomic_file_set_aside(path, &fault);
    CHECK(strstr(fault.text, ".damaged") != NULL);
    CHECK(atomic_file_read(path, 100, &size) == NULL);
    snprintf(path, sizeof path, "%s/a.damaged", folder);
    CHECK_INT(remove(path), 0);
    CHECK_INT(remove(folder), 0);
}

int main(void)
{
    RUN(pages_come_back);
    RUN(an_empty_map_is_a_map);
    RUN(the_origin_is_in_the_file);
    RUN(the_residual_comes_back);
    RUN(every_damage_is_found);
    RUN(what_is_sealed_and_wrong_is_refused);
    RUN(the_surface_is_by_definition);
    RUN(a_normal_points_into_the_water);
    RUN(the_tree_joins_and_counts);
    RUN(a_map_beyond_the_tree_is_refused);
    RUN(the_cloud_is_one_message);
    RUN(no_strangers_file_is_replaced);
    return test_end();
}
