/* SPDX-License-Identifier: MIT */
/* What a page may change: lines that are one, with the token, and a file that is as before when it goes wrong. */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/lib/test.h"
#include "web/web_settings.h"

/* In the place of the C library's: a disk that notes what it is told, and may fail to confirm. */
static char journal[40];
static bool disk_fails;

int fsync(int fd)
{
    (void)fd;
    strcat(journal, "sync ");
    errno = EIO;
    return disk_fails ? -1 : 0;
}

int rename(const char *from, const char *to)
{
    strcat(journal, "rename ");
    return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

static char folder[] = "/tmp/sonard-settings-XXXXXX", path[80], token_path[80];

static void write_file(const char *at, const char *text, mode_t mode)
{
    FILE *out = fopen(at, "w");
    CHECK(out != NULL);
    fputs(text, out);
    fclose(out);
    chmod(at, mode);
}

static const char *content(void)
{
    static char text[4096];
    FILE *in = fopen(path, "r");
    text[in ? fread(text, 1, sizeof text - 1, in) : 0] = '\0';
    if (in)
        fclose(in);
    return text;
}

static void begin(struct web_settings *s)
{
    struct fault fault = {""};
    unlink(path);
    write_file(token_path, "0123456789abcdef\n", 0600);
    CHECK(web_settings_open(s, path, token_path, &fault));
}

/* Put in and saved, as when the daemon takes it. */
static bool change(struct web_settings *s, const char *text)
{
    struct web_setting setting;
    struct fault fault = {""};
    journal[0] = '\0';
    return web_settings_parse(text, &setting, &fault) && web_settings_change(s, &setting, &fault) &&
           web_settings_save(s, &fault);
}

TEST(lines)
{
    static const char *const good[] = {"[grid] clear_for = 20 s", "[sonar front] mount = 0.1 0 -0.2 m",
                                       "[extract] detector = os", "[water] sound_speed = 1.48 km/s"};
    static const char *const bad[] = {"",
                                      "x",
                                      "[grid]",
                                      "[grid] clear_for",
                                      "[grid] clear_for =",
                                      "[grid] clear_for = ",
                                      "[grid] clear_for =  x",
                                      "[grid ] clear_for = 20 s",
                                      "[sonar  front] rotation = 0 0 180 deg",
                                      "[grid] = 1",
                                      "[] a = 1",
                                      "[grid] a = 1\n[server]",
                                      "[grid] a = 1\nb = 2",
                                      "[grid] a = 1;",
                                      "[grid] a = \"1\"",
                                      "[grid]] a = 1",
                                      "[server] change = all",
                                      "[server ] change = all",
                                      "[ server] change = all",
                                      "[grid] a = ../\xff"};
    char longer[WEB_SETTINGS_LINE + 20] = "[grid] a = ";
    struct web_setting setting;
    struct fault fault;
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        CHECK(web_settings_parse(good[i], &setting, &fault));
        CHECK(strcmp(setting.text, good[i]) == 0);
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        fault.text[0] = '\0';
        if (web_settings_parse(bad[i], &setting, &fault))
            printf("# taken: %s\n", bad[i]);
        CHECK(!web_settings_parse(bad[i], &setting, &fault) && fault.text[0]);
    }
    memset(longer + 11, '1', sizeof longer - 12);
    CHECK(!web_settings_parse(longer, &setting, &fault));
}

TEST(tokens)
{
    static const char *const wrong[] = {
        "", "0", "0123456789abcde", "0123456789abcdefg", "1123456789abcdef", "0123456789abcdeF"};
    static struct web_settings s;
    struct fault fault;
    begin(&s);
    CHECK(web_settings_token(&s, "0123456789abcdef"));
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        CHECK(!web_settings_token(&s, wrong[i]));
    s = (struct web_settings){0};
    CHECK(!web_settings_token(&s, ""));
    write_file(token_path, "short\n", 0600);
    CHECK(!web_settings_open(&s, path, token_path, &fault) && strstr(fault.text, "16"));
    write_file(token_path, "0123456789abcdef\n", 0644);
    CHECK(!web_settings_open(&s, path, token_path, &fault) && strstr(fault.text, "chmod"));
    unlink(token_path);
    CHECK(!web_settings_open(&s, path, token_path, &fault));
}

TEST(a_key_stands_once_and_its_section_too)
{
    static struct web_settings s;
    struct fault fault;
    begin(&s);
    CHECK(change(&s, "[grid] forget = 220 s"));
    CHECK(change(&s, "[extract] floor = 9"));
    CHECK(change(&s, "[grid] clear_for = 20 s"));
    CHECK(change(&s, "[grid] clear_for = 21 s"));
    CHECK(strstr(content(), "[extract]\nfloor = 9\n[grid]\nclear_for = 21 s\nforget = 220 s\n"));
    CHECK_INT(s.n, 3);
    CHECK(web_settings_take_back(&s, &fault));
    CHECK(strstr(content(), "clear_for = 20 s\n"));
    CHECK(web_settings_open(&s, path, token_path, &fault));
    CHECK_INT(s.n, 3);
    CHECK(change(&s, "[grid] clear_for = 30 s"));
    CHECK(strstr(content(), "[extract]\nfloor = 9\n[grid]\nclear_for = 30 s\nforget = 220 s\n"));
}

TEST(files_of_others_are_left_alone)
{
    static const char text[] = "[grid]\nclear_for = 20 s ; mine\n";
    static struct web_settings s;
    struct fault fault;
    begin(&s);
    write_file(path, text, 0644);
    CHECK(!web_settings_open(&s, path, token_path, &fault));
    CHECK(strcmp(content(), text) == 0);
}

TEST(a_full_file_and_a_missing_folder_change_nothing)
{
    static struct web_settings s;
    char text[60];
    begin(&s);
    for (int i = 0; i < WEB_SETTINGS_MAX; i++) {
        snprintf(text, sizeof text, "[grid] k%d = 1", i);
        CHECK(change(&s, text));
    }
    CHECK(!change(&s, "[grid] more = 1"));
    CHECK(change(&s, "[grid] k3 = 2"));
    CHECK_INT(s.n, WEB_SETTINGS_MAX);
    begin(&s);
    s.path = "/nonexistent/x.conf";
    CHECK(!change(&s, "[grid] a = 1"));
    web_settings_forget(&s);
    CHECK_INT(s.n, 0);
}

/* The daemon is asked about the text first: until it is saved the file is as it was. */
TEST(a_change_is_not_in_the_file_before_it_is_saved)
{
    static struct web_settings s;
    struct web_setting setting;
    struct fault fault;
    char before[4096], *text, *file;
    begin(&s);
    CHECK(change(&s, "[grid] clear_for = 20 s"));
    snprintf(before, sizeof before, "%s", content());
    CHECK(web_settings_parse("[grid] clear_for = 1 parsec", &setting, &fault) &&
          web_settings_change(&s, &setting, &fault));
    text = web_settings_text(&s);
    CHECK(text && strstr(text, "[grid]\nclear_for = 1 parsec\n") != NULL);
    free(text);
    CHECK_STR(content(), before);
    web_settings_forget(&s);
    text = web_settings_text(&s);
    CHECK_STR(text, before);
    free(text);
    file = web_settings_file(&s, &fault);
    CHECK_STR(file, path);
    free(file);
    s.path = "/nonexistent/x.conf";
    CHECK(!web_settings_file(&s, &fault) && strstr(fault.text, "/nonexistent"));
}

TEST(the_disk_has_confirmed_a_file_before_it_takes_the_name)
{
    struct web_settings s;
    begin(&s);
    CHECK(change(&s, "[grid] clear_for = 20 s"));
    CHECK_STR(journal, "sync rename ");
    disk_fails = true;
    CHECK(!change(&s, "[grid] clear_for = 30 s"));
    disk_fails = false;
    CHECK_STR(journal, "sync ");
    CHECK(strstr(content(), "clear_for = 20 s") != NULL);
    unlink(path);
}

int main(void)
{
    CHECK(mkdtemp(folder) != NULL);
    snprintf(path, sizeof path, "%s/web.conf", folder);
    snprintf(token_path, sizeof token_path, "%s/token", folder);
    RUN(lines);
    RUN(tokens);
    RUN(a_key_stands_once_and_its_section_too);
    RUN(files_of_others_are_left_alone);
    RUN(a_full_file_and_a_missing_folder_change_nothing);
    RUN(a_change_is_not_in_the_file_before_it_is_saved);
    RUN(the_disk_has_confirmed_a_file_before_it_takes_the_name);
    unlink(path);
    unlink(token_path);
    rmdir(folder);
    return test_end();
}
