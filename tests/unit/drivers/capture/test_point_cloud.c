/* SPDX-License-Identifier: MIT */
/* test_point_cloud - the message as Foxglove's schema has it, byte for byte; base64 by the vectors of RFC 4648. */
#include "tests/lib/test.h"

#include <string.h>

#include "drivers/capture/point_cloud.h"

TEST(points_are_base64)
{
    static const struct {
        const char *bytes, *text;
    } row[] = {{"", ""},
               {"f", "Zg=="},
               {"fo", "Zm8="},
               {"foo", "Zm9v"},
               {"foob", "Zm9vYg=="},
               {"fooba", "Zm9vYmE="},
               {"foobar", "Zm9vYmFy"},
               {"\xff\xff\xfe\xfb\xf0", "///++/A="}};
    static const struct point_field fields[] = {{"tag", POINT_UINT8}, {NULL, POINT_UINT8}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const struct point_cloud cloud = {.frame_id = "map",
                                          .fields = fields,
                                          .points = (const uint8_t *)row[i].bytes,
                                          .bytes = strlen(row[i].bytes)};
        struct fault fault;
        char got[600], want[40];
        size_t size = 0;
        uint8_t *message = point_cloud_message(&cloud, &size, &fault);
        snprintf(got, sizeof got, "%.*s", (int)size, (const char *)message);
        snprintf(want, sizeof want, "\"data\":\"%s\"}", row[i].text);
        const char *data = strstr(got, "\"data\"");
        CHECK_STR(data ? data : got, want);
        free(message);
    }
}

TEST(the_message_has_its_time_and_where_its_fields_lie)
{
    static const struct point_field fields[] = {{"x", POINT_FLOAT64}, {"sure", POINT_FLOAT32},
                                                {"n", POINT_UINT32},  {"bin", POINT_UINT16},
                                                {"tag", POINT_UINT8}, {NULL, POINT_UINT8}};
    static const char want[] =
        "{\"timestamp\":{\"sec\":1500000000,\"nsec\":123456789},\"frame_id\":\"vehicle\",\"pose\":{\"position\":{"
        "\"x\":0,\"y\":0,\"z\":0},\"orientation\":{\"x\":0,\"y\":0,\"z\":0,\"w\":1}},\"point_stride\":19,"
        "\"fields\":["
        "{\"name\":\"x\",\"offset\":0,\"type\":8},{\"name\":\"sure\",\"offset\":8,\"type\":7},"
        "{\"name\":\"n\",\"offset\":12,\"type\":5},{\"name\":\"bin\",\"offset\":16,\"type\":3},"
        "{\"name\":\"tag\",\"offset\":18,\"type\":1}],\"data\":\"AAAAAAAA+L8AAABABAMCAQYFBw==\"}";
    uint8_t point[19], *at = point;
    struct fault fault;
    char got[700];
    size_t size = 0;
    at = point_put_double(at, -1.5); /* 00 00 00 00 00 00 f8 bf */
    at = point_put_float(at, 2);     /* 00 00 00 40 */
    at = point_put(at, 0x01020304, 4);
    at = point_put(at, 0x0506, 2);
    at = point_put(at, 0x07, 1);
    CHECK_INT(at - point, point_bytes(fields));
    const struct point_cloud cloud = {.t_unix_ns = 1500000000123456789u,
                                      .frame_id = "vehicle",
                                      .fields = fields,
                                      .points = point,
                                      .bytes = sizeof point};
    uint8_t *message = point_cloud_message(&cloud, &size, &fault);
    snprintf(got, sizeof got, "%.*s", (int)size, (const char *)message);
    CHECK_STR(got, want);
    free(message);
}

int main(void)
{
    RUN(points_are_base64);
    RUN(the_message_has_its_time_and_where_its_fields_lie);
    return test_end();
}
