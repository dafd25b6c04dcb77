/* SPDX-License-Identifier: MIT */
/*
 * test_protobuf - bytes as the encoding says they are: those of the messages by hand from its rules, those of the
 * descriptions as protoc writes them. The live tests have other people's readers decode what is sent.
 */
#include "client/view/answer_type.h"
#include "client/view/foxglove.h"
#include "client/view/protobuf.h"
#include "tests/lib/test.h"

#define FIELDS(...)                                                                                               \
    (const struct message_field[])                                                                                \
    {                                                                                                             \
        __VA_ARGS__,                                                                                              \
        {                                                                                                         \
            .name = NULL                                                                                          \
        }                                                                                                         \
    }

static const struct message_type inner = {"some.Inner", FIELDS({.name = "n", .number = 1, .kind = MESSAGE_INT32})};
static const struct message_type outer = {
    "some.Outer",
    FIELDS({.name = "a", .number = 1, .kind = MESSAGE_INT64}, {.name = "b", .number = 2, .kind = MESSAGE_TEXT},
           {.name = "c", .number = 3, .kind = MESSAGE_OBJECT, .of = &inner},
           {.name = "d", .number = 4, .kind = MESSAGE_DOUBLE, .maybe = true},
           {.name = "e", .number = 16, .kind = MESSAGE_FIXED32, .repeated = true},
           {.name = "f", .number = 6, .kind = MESSAGE_OBJECT, .of = &inner, .repeated = true},
           {.name = "g", .number = 7, .kind = MESSAGE_WORD, .words = "Kind: NONE SOME"},
           {.name = "h", .number = 8, .kind = MESSAGE_DOUBLE, .repeated = true})};

static const struct message_type around = {
    "some.Around", FIELDS({.name = "o", .number = 1, .kind = MESSAGE_OBJECT, .of = &outer})};
static const struct message_type log_type = {
    "some.Log", FIELDS({.name = "of", .number = 1, .kind = MESSAGE_OBJECT, .of = &inner},
                       {.name = "level", .number = 2, .kind = MESSAGE_WORD, .words = "Level: LOW HIGH"},
                       {.name = "r", .number = 3, .kind = MESSAGE_DOUBLE, .repeated = true})};

static void check_hex(const struct bytes *out, const char *hex)
{
    char got[1024] = "";
    CHECK(!out->failed && out->size < sizeof got / 2);
    for (size_t i = 0; i < out->size && i < sizeof got / 2 - 1; i++)
        snprintf(got + 2 * i, 3, "%02x", out->data[i]);
    CHECK_STR(got, hex);
}

static void check_bytes(const char *json, const char *hex)
{
    struct bytes out = {0};
    json_t *message = json_loads(json, 0, NULL);
    CHECK(message != NULL);
    protobuf_message(&outer, message, &out);
    check_hex(&out, hex);
    json_decref(message);
    free(out.data);
}

#define NONE "21000000000000f87f" /* d, of a message that says nothing of it */

TEST(numbers_and_texts)
{
    check_bytes("{}", NONE);
    check_bytes("{\"a\":150,\"d\":null}", "089601" NONE);
    check_bytes("{\"a\":-1,\"d\":0}", "08ffffffffffffffffff01");
    check_bytes("{\"b\":\"testing\",\"d\":1}", "120774657374696e6721000000000000f03f");
    check_bytes("{\"g\":1}", NONE "3801");
    check_bytes("{\"h\":[1,null,\"inf\"]}", NONE "4218000000000000f03f000000000000f87f000000000000f07f");
    check_bytes("{\"e\":[1,258]}", NONE "8201080100000002010000");
}

TEST(objects)
{
    check_bytes("{\"c\":{\"n\":150}}", "1a03089601" NONE);
    check_bytes("{\"c\":{}}", "1a00" NONE);
    check_bytes("{\"f\":[{\"n\":1},{},{\"n\":2}]}", NONE "3202080132003202"
                                                         "0802");
}

TEST(what_is_of_another_kind_is_left_out)
{
    check_bytes("{\"b\":5,\"c\":[1],\"f\":{\"n\":1},\"e\":7,\"z\":1}", NONE);
    check_bytes("{\"f\":[null,7,{\"n\":1}]}", NONE "32020801");
}

/* An object of more than 127 bytes: its length takes two. */
TEST(long_objects_have_long_lengths)
{
    struct bytes out = {0};
    char text[301] = "";
    memset(text, 'x', 300);
    json_t *message = json_pack("{s:{s:s, s:i}}", "o", "b", text, "d", 0);
    protobuf_message(&around, message, &out);
    CHECK_INT(out.size, 1 + 2 + 303);
    CHECK(memcmp(out.data, "\x0a\xaf\x02\x12\xac\x02x", 7) == 0);
    json_decref(message);
    free(out.data);
}

/* As protoc 3.21 writes it of these types with --include_imports --descriptor_set_out, less the json_name of fields. */
TEST(a_schema_is_a_set_of_file_descriptors)
{
    struct bytes out = {0};
    protobuf_schema(&log_type, &out);
    check_hex(&out,
              "0a340a10736f6d652f496e6e65722e70726f746f1204736f6d6522120a05496e6e657212090a016e1801200128056206"
              "70726f746f330a97010a0e736f6d652f4c6f672e70726f746f1204736f6d651a10736f6d652f496e6e65722e70726f74"
              "6f22650a034c6f6712170a026f6618012001280b320b2e736f6d652e496e6e6572121e0a056c6576656c18022001280e"
              "320f2e736f6d652e4c6f672e4c6576656c12090a0172180320032801221a0a054c6576656c12070a034c4f5710001208"
              "0a04484947481001620670726f746f33");
    free(out.data);
}

/* The fields of a result by their order, with the types of what is in them. */
TEST(results_have_types)
{
    const struct message_type *sectors = answer_type("sectors"), *status = answer_type("status");
    const struct message_field *f = sectors ? sectors->fields : NULL;
    int found = 0;
    CHECK(sectors && status && !answer_type("nonsense"));
    CHECK_STR(sectors->name, "sonard.sectors");
    for (int n = 1; f && f->name; f++, n++) {
        CHECK_INT(f->number, n);
        if (strcmp(f->name, "sectors") == 0) {
            CHECK(f->repeated && f->kind == MESSAGE_OBJECT);
            CHECK_STR(f->of->name, "sonard.sector");
            for (const struct message_field *g = f->of->fields; g->name; g++)
                if (strcmp(g->name, "range_m") == 0)
                    found += g->kind == MESSAGE_DOUBLE && g->maybe && !g->repeated;
        }
        if (strcmp(f->name, "pose_age_s") == 0)
            found += f->kind == MESSAGE_DOUBLE && f->maybe;
        if (strcmp(f->name, "frame") == 0)
            found += f->kind == MESSAGE_TEXT;
    }
    CHECK_INT(found, 3);
    CHECK(answer_type("sectors") == sectors);
}

int main(void)
{
    RUN(numbers_and_texts);
    RUN(objects);
    RUN(what_is_of_another_kind_is_left_out);
    RUN(long_objects_have_long_lengths);
    RUN(a_schema_is_a_set_of_file_descriptors);
    RUN(results_have_types);
    return test_end();
}
