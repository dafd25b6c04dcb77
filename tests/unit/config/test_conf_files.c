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
    char path[64];
    unlink(main_path);
    snprintf(path, sizeof path, "%s/t.conf.d", folder);
    rmdir(path);
    rmdir(folder);
    return test_end();
}
