/* SPDX-License-Identifier: MIT */
/* test_conf_files - a configuration and the files of its folder: who wins, which file a fault and a value came from. */
#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "config/conf.h"
#include "tests/lib/test.h"

#define BASE "[sonar a]\ndevice = ping360\nport = serial:/dev/x:115200\n"

static char folder[] = "/tmp/sonard-test-XXXXXX", main_path[64], faults_seen[4096];

static void note_fault(void *ctx, const char *message)
{
    (void)ctx;
    size_t used = strlen(faults_seen), shown = strncmp(message, folder, strlen(folder)) ? 0 : strlen(folder) + 1;
    snprintf(faults_seen + used, sizeof faults_seen - used, "%s%s", used > 0 ? "\n" : "", message + shown);
}

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    CHECK(file != NULL);
    if (!file)
        return;
    fputs(text, file);
    fclose(file);
}

static void write_in(const char *name, const char *text)
{
    char path[512];
    snprintf(path, sizeof path, "%s/t.conf.d/%s", folder, name);
    write_text(path, text);
}

static void empty_folder(void)
{
    char path[512];
    snprintf(path, sizeof path, "%s/t.conf.d", folder);
    mkdir(path, 0700);
    DIR *dir = opendir(path);
    for (struct dirent *entry; dir && (entry = readdir(dir));)
        if (entry->d_name[0] != '.' || strlen(entry->d_name) > 2)
            unlinkat(dirfd(dir), entry->d_name, 0);
    if (dir)
        closedir(dir);
}

static int load(struct conf *conf, struct conf_source **source)
{
    faults_seen[0] = '\0';
    return conf_load(conf, source, main_path, NULL, note_fault, NULL);
}

static char *printed(const struct conf *conf, const struct conf_source *source)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    conf_print(conf, source, out);
    fclose(out);
    return text;
}

TEST(later_names_win)
{
    struct conf conf;
    struct conf_source *source;
    empty_folder();
    write_text(main_path, BASE "range = 5 m\nstep = 2 deg\n[grid]\nclear_for = 10 s\n");
    write_in("10-a.conf", "[grid]\nclear_for = 20 s\nlayer = 10 cm\n[sonar a]\nrange = 6 m\n");
    write_in("9-b.conf", "[grid]\nclear_for = 40 s\n"); /* names, not numbers: behind 10-a */
    write_in("Z.conf", "[sonar a]\nrange = 7 m\n");
    write_in("c.conf.bak", "nonsense");
    write_in(".hidden.conf", "nonsense");
    write_in("README", "nonsense");
    CHECK_INT(load(&conf, &source), 0);
    CHECK_STR(faults_seen, "");
    CHECK_INT(conf.n_sonars, 1);
    CHECK(conf.grid.clear_for_s == 40);
    CHECK(conf.grid.layer_m == 0.1);
    CHECK(conf.sonar[0].range_m == 7);
    char *text = printed(&conf, source);
    CHECK(strstr(text, "t.conf.d/9-b.conf:2\n") != NULL);
    CHECK(strstr(text, "t.conf.d/10-a.conf:3\n") != NULL);
    CHECK(strstr(text, "t.conf.d/Z.conf:2\n") != NULL);
    CHECK(strstr(text, "t.conf:5\n") != NULL);
    free(text);
    conf_source_free(source);
}

/* Captures keep one text: it must mean what the files meant. */
TEST(the_text_is_of_them_all)
{
    struct conf conf, again;
    struct conf_source *source, *of_text;
    size_t size;
    empty_folder();
    write_text(main_path, BASE "range = 5 m\n");
    CHECK_INT(load(&conf, &source), 0);
    CHECK_STR(conf_source_text(source, &size), BASE "range = 5 m\n");
    conf_source_free(source);
    write_in("b.conf", "[sonar b]\ndevice = ping360\nport = serial:/dev/y:115200\n[grid]\nclear_for = 20 s\n");
    CHECK_INT(load(&conf, &source), 0);
    CHECK_INT(conf.n_sonars, 2);
    const char *text = conf_source_text(source, &size);
    CHECK_INT(conf_load_text(&again, &of_text, &(struct conf_text){"text", text, size}, NULL, note_fault, NULL),
              0);
    CHECK_STR(faults_seen, "");
    CHECK(memcmp(&conf, &again, sizeof conf) == 0);
    conf_source_free(of_text);
    conf_source_free(source);
}

TEST(faults_name_their_file)
{
    struct conf conf;
    struct conf_source *source;
    empty_folder();
    write_text(main_path, BASE "range = 500 m\n[grid]\nclear_for = 30 s\n");
    write_in("a.conf", "[grid]\nforget = 20 s\nforget = 30 s\n[sonar b]\ndevice = ping360\n");
    write_in("b.conf", "clear_for = 1 s\n[grid]\nclear_fro = 1 s\n");
    CHECK(load(&conf, &source) == 6);
    CHECK_STR(faults_seen,
              "t.conf:4: [sonar a] range = 500 m: out of range; expected 0.75 to 200 m (m, cm, mm, km)\n"
              "t.conf.d/a.conf:2: [grid] forget = 20 s: does not go with [grid] clear_for = 30 s; expected "
              "forget not shorter than clear_for\n"
              "t.conf.d/a.conf:3: [grid] forget = 30 s: duplicate key (first set on line 2)\n"
              "t.conf.d/a.conf:4: [sonar b] port: missing; expected KIND:ADDRESS, for instance "
              "serial:/dev/ttyUSB0:115200\n"
              "t.conf.d/b.conf:1: clear_for = 1 s: no section before it; put a [section] line "
              "above it\n"
              "t.conf.d/b.conf:3: [grid] clear_fro = 1 s: unknown key; did you mean clear_for?");
    conf_source_free(source);
}

TEST(a_file_that_cannot_be_read_is_a_fault)
{
    struct conf conf;
    struct conf_source *source;
    char path[512];
    empty_folder();
    write_text(main_path, BASE);
    snprintf(path, sizeof path, "%s/t.conf.d/gone.conf", folder);
    CHECK(symlink("/nowhere/at/all", path) == 0);
    CHECK_INT(load(&conf, &source), -1);
    CHECK_STR(faults_seen,
              "t.conf.d/gone.conf: cannot be read: No such file or directory; expected a readable file of at "
              "most 1048576 bytes");
    conf_source_free(source);
    empty_folder();
}

TEST(too_many_files_are_a_fault)
{
    struct conf conf;
    struct conf_source *source;
    char name[32];
    empty_folder();
    for (int i = 0; i < 64; i++) {
        snprintf(name, sizeof name, "%02d.conf", i);
        write_in(name, "");
    }
    CHECK_INT(load(&conf, &source), -1);
    CHECK(strstr(faults_seen, "64 files in the folder") != NULL);
    conf_source_free(source);
    empty_folder();
}

/* The text of a file that is there or not, in its place among the others. */
TEST(a_file_can_be_tried_before_it_is_there)
{
    struct conf conf;
    struct conf_source *source;
    const struct conf_text text = {"m.conf", "[grid]\nclear_for = 30 s\n", 24};
    static const char *const others[][2] = {{"a.conf", "30"}, {"m.conf", "30"}, {"z.conf", "20"}};
    empty_folder();
    write_text(main_path, BASE);
    for (size_t i = 0; i < 3; i++) {
        empty_folder();
        write_in(others[i][0], "[grid]\nclear_for = 20 s\n");
        faults_seen[0] = '\0';
        CHECK_INT(conf_load_with(&conf, &source, &(struct conf_where){main_path, &text}, NULL, note_fault, NULL),
                  0);
        CHECK(conf.grid.clear_for_s == strtod(others[i][1], NULL));
        conf_source_free(source);
    }
    empty_folder();
    CHECK_INT(conf_load_with(&conf, &source,
                             &(struct conf_where){main_path, &(struct conf_text){"m.conf", "[grid]\nx = 1\n", 13}},
                             NULL, note_fault, NULL),
              1);
    CHECK(strstr(faults_seen, "t.conf.d/m.conf:2: [grid] x = 1: unknown key") != NULL);
    conf_source_free(source);
}

TEST(which_files_are_read)
{
    char file[128];
    static const struct {
        const char *file;
        bool read;
    } row[] = {{"t.conf.d/web.conf", true}, {"t.conf.d/web.conf.new", false}, {"t.conf.d/.conf", false},
               {"web.conf", false},         {"t.conf.d/x/web.conf", false},   {"t.conf", false}};
    empty_folder();
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        snprintf(file, sizeof file, "%s/%s", folder, row[i].file);
        const char *name = conf_drop_in(main_path, file);
        CHECK_STR(name ? name : "not read", row[i].read ? "web.conf" : "not read");
    }
    CHECK(!conf_drop_in(main_path, "web.conf") &&
          !conf_drop_in("/nonexistent/t.conf", "/nonexistent/t.conf.d/a.conf"));
}

#define PAGE "# by the page"
#define A    "[sonar a]\nrange = 8 m\n"

static char left_out[2048];

static void note_left_out(void *ctx, const char *message)
{
    (void)ctx;
    size_t used = strlen(left_out), shown = strncmp(message, folder, strlen(folder)) ? 0 : strlen(folder) + 1;
    snprintf(left_out + used, sizeof left_out - used, "%s%.120s", used > 0 ? "\n" : "", message + shown);
}

static bool no_other_device(const char *name, struct fault *fault)
{
    return strcmp(name, "ping360") == 0 || fault_set(fault, "unknown device");
}

/* What a page wrote must not keep the daemon from starting; what is good of it holds, and what is wrong was never in
 * force, so that what the files before say is. */
TEST(a_wrong_line_of_a_page_is_left_out)
{
    static const struct {
        const char *page, *left_out;
        double range_m;
    } row[] = {
        {"[grid]\nclear_for = 1 parsec\n" A, "m.conf:3: [grid] clear_for = 1 parsec: ", 8},
        {A "[grid]\nclear_for = 0.1 s\n", "m.conf:5: [grid] clear_for = 0.1 s: out of range", 8},
        {"[grid]\nold_key = 3\n" A, "m.conf:3: [grid] old_key = 3: unknown key", 8},
        {"[gird]\nclear_for = 9 s\n" A, "m.conf:2: [gird]: unknown section", 8},
        {"[sonar gone]\nrange = 7 m\n" A, "m.conf:2: [sonar gone]: no file before has this section", 8},
        {"[grid gone]\nclear_for = 9 s\n" A, "m.conf:2: [grid gone]: no file before has this section", 8},
        {A "device = other\n", "m.conf:4: [sonar a] device = other: unknown device", 8},
        {A "range = 9 m\n", "m.conf:4: [sonar a] range = 9 m: duplicate key", 8},
        {A A, "m.conf:4: [sonar a]: duplicate section", 8},
        {"clear_for = 9 s\n" A, "m.conf:2: clear_for = 9 s: no section before it", 8},
        {"[grid]\nclear_for\n" A, "m.conf:3: clear_for: not a key and its value", 8},
        {"[grid]\n\x01\x02\n" A, "m.conf:3: byte 0x01 in column 1", 5},
    };
    struct conf_checks checks = {.device = no_other_device, .page_file = PAGE};
    struct conf conf;
    struct conf_source *source;
    char text[256];
    empty_folder();
    write_text(main_path, BASE "range = 5 m\n[grid]\nclear_for = 12 s\n");
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        for (int starts = 0; starts < 2; starts++) {
            snprintf(text, sizeof text, PAGE "\n%s", row[i].page);
            write_in("m.conf", text);
            checks.left_out = starts ? note_left_out : NULL;
            left_out[0] = faults_seen[0] = '\0';
            const int n = conf_load(&conf, &source, main_path, &checks, note_fault, NULL);
            if (starts) {
                CHECK_INT(n, 0);
                CHECK_STR(faults_seen, "");
                CHECK(strstr(left_out, row[i].left_out) != NULL);
                CHECK(conf.grid.clear_for_s == 12 && conf.n_sonars == 1 && conf.n_more_grids == 0);
                CHECK_STR(conf.sonar[0].device, "ping360");
                CHECK(conf.sonar[0].range_m == row[i].range_m);
                size_t size;
                CHECK(strstr(conf_source_text(source, &size), "clear_for = 12 s") != NULL);
            } else {
                CHECK(n > 0 || strstr(row[i].page, "[grid gone]")); /* which is good, and needs a restart */
                CHECK_STR(left_out, "");
            }
            conf_source_free(source);
        }
    }
}

/* Files of others, keys that do not go together, and what is missing are faults as ever. */
TEST(all_else_is_a_fault_beside_a_page_as_well)
{
    const struct conf_checks checks = {.page_file = PAGE, .left_out = note_left_out};
    struct conf conf;
    struct conf_source *source;
    static const char *const row[][2] = {{"m.conf", "# by hand\n[grid]\nold_key = 3\n"},
                                         {"m.conf", PAGE "s\n[grid]\nold_key = 3\n"},
                                         {"m.conf", PAGE "\n[grid]\nclear_for = 30 s\nforget = 20 s\n"}};
    write_text(main_path, BASE);
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        empty_folder();
        write_in(row[i][0], row[i][1]);
        left_out[0] = faults_seen[0] = '\0';
        CHECK_INT(conf_load(&conf, &source, main_path, &checks, note_fault, NULL), 1);
        CHECK_STR(left_out, "");
        conf_source_free(source);
    }
    empty_folder();
    write_text(main_path, PAGE "\n" BASE "old_key = 3\n");
    CHECK_INT(conf_load(&conf, &source, main_path, &checks, note_fault, NULL), 1);
    conf_source_free(source);
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    snprintf(main_path, sizeof main_path, "%s/t.conf", folder);
    RUN(later_names_win);
    RUN(the_text_is_of_them_all);
    RUN(faults_name_their_file);
    RUN(a_file_that_cannot_be_read_is_a_fault);
    RUN(too_many_files_are_a_fault);
    RUN(a_file_can_be_tried_before_it_is_there);
    RUN(which_files_are_read);
    RUN(a_wrong_line_of_a_page_is_left_out);
    RUN(all_else_is_a_fault_beside_a_page_as_well);
    char path[64];
    unlink(main_path);
    snprintf(path, sizeof path, "%s/t.conf.d", folder);
    rmdir(path);
    rmdir(folder);
    return test_end();
}
