/* SPDX-License-Identifier: MIT */
/*
 * capture - command line of the capture tool, and the command repair.
 */
#include "capture.h"

#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <stdarg.h>
#include <string.h>
#include <unistd.h>

#include "capture_file.h"
#include "client/arguments.h"
#include "config/word.h"

#define IMPORTER "sonard-import"

static const char usage_text[] =
    "usage: sonarctl capture import [--sensor NAME] [--conf FILE] [--zone H[:MM]] IN OUT.mcap\n"
    "       sonarctl capture info FILE\n"
    "       sonarctl capture repair IN OUT\n"
    "       sonarctl capture export --csv FILE [OUT]\n"
    "       sonarctl capture export --foxglove|--ros2 [--conf CONF] FILE OUT.mcap\n"
    "       sonarctl capture add-pose [--offset S] FILE POSES OUT\n"
    "\n"
    "import  make a capture from a recording of another program: sonard-import(1). sonard-rosbag(1) makes them "
    "of\n"
    "        ROS bags\n"
    "info    channels, counts, times, attachments, damage; the exit status is 1 when there is damage, or when\n"
    "        it is not closed: still being written, or cut off\n"
    "repair  write what is readable of a damaged or cut-off capture as a complete one, and say what is left out\n"
    "export  pings of a Ping360 or a SeaNet head as t_s,bearing_deg,range_max_m,n,v0.., what is not received\n"
    "        from a sonar as topic,t_s,hex; received bytes of other devices are left out.\n"
    "        --foxglove: a file that Foxglove shows: pings, image, echoes, sectors, pose, map and log, as sonard\n"
    "        answers when it replays the capture, with its configuration or CONF. --ros2: the same as a bag of\n"
    "        ROS 2\n"
    "add-pose\n"
    "        a copy with the poses of another log: lines of JSON as sonard-poses prints them, S seconds later; "
    "where\n"
    "        the computer's clock was set during the capture (info shows that), it says whose clock it takes for "
    "theirs\n"
    "\n"
    "Exit status: 0 done; 1 failed, or written, but more than half could not be read, or exported, but the "
    "capture\n"
    "is damaged or not closed: what could be read is there; 2 wrong usage. Existing files are not overwritten; "
    "one\n"
    "that is being written is called OUT.part.\n";

static int wrong_usage(const char *why)
{
    fprintf(stderr, "sonarctl capture: %s\n\n%s", why, usage_text);
    return 2;
}

/* ---- repair ---- */

/* Bytes of the largest readable message, so that the writer asks for no more memory than it needs. */
static size_t largest_message(const char *path)
{
    struct fault fault;
    struct mcap_message m;
    size_t largest = 0;
    struct mcap_reader *r = mcap_open(path, NULL, NULL, &fault);
    while (r && mcap_next(r, &m))
        largest = m.size > largest ? m.size : largest;
    mcap_close(r);
    return largest;
}

static bool copy_attachments(const struct mcap_reader *r, struct mcap_writer *w, struct fault *fault)
{
    struct mcap_attachment a;
    for (uint64_t at = 0; mcap_next_attachment(r, &at, &a);)
        if (a.crc_good && !mcap_attach(w, &a, fault))
            return false;
    return true;
}

/* Channels that the reader has met and the writer has not; their numbers become the same. */
static bool copy_channels(const struct mcap_reader *r, struct mcap_writer *w, size_t *copied, unsigned *schemas,
                          struct fault *fault)
{
    const struct mcap_channel *c;
    for (; (c = mcap_channel_at(r, *copied)) != NULL; (*copied)++) {
        *schemas += c->schema_id != 0;
        if (mcap_add_channel(w, c->topic, c->encoding, c->metadata, c->n_metadata, fault) < 0)
            return false;
    }
    return true;
}

static bool copy_messages(struct mcap_reader *r, struct mcap_writer *w, struct fault *fault)
{
    struct mcap_message m;
    size_t channels = 0;
    unsigned schemas = 0;
    while (mcap_next(r, &m))
        if (!copy_channels(r, w, &channels, &schemas, fault) ||
            !mcap_write_message(w, (int)m.channel->index, &m, fault))
            return false;
    if (schemas)
        printf("schemas are left out: %u of the channels had one\n", schemas);
    return copy_channels(r, w, &channels, &schemas, fault);
}

static int repair(const char *in_path, const char *out_path)
{
    struct fault fault;
    size_t largest = largest_message(in_path);
    struct mcap_reader *r = capture_open(in_path);
    struct mcap_writer *w = r ? capture_create(out_path, NULL, largest > MCAP_MESSAGE_BYTES ? largest : 0) : NULL;
    int status = 1;
    if (w) {
        bool ok = copy_attachments(r, w, &fault) && copy_messages(r, w, &fault);
        status = capture_finish(w, out_path, ok, &fault);
    }
    if (status == 0) {
        const struct mcap_info *info = mcap_info(r);
        printf("%s: %" PRIu64 " messages, attachments: %" PRIu64 "; faults: %" PRIu64 ", bytes left out: %" PRIu64
               "\n",
               out_path, info->messages, info->attachments, info->problems, info->left_out_bytes);
        if (mcap_is_mostly_lost(info)) {
            mcap_lost_text(info, &fault);
            status = capture_failed("%s: %s", in_path, fault.text);
        }
    }
    mcap_close(r);
    return status;
}

/* ---- command line ---- */

/* Where the search path has none: beside this program, or in the source tree that it was built in. */
static void run_beside(char **argv)
{
    static const char *const places[] = {"", "../python/"};
    char own[PATH_MAX], path[PATH_MAX + 64];
    const ssize_t n = readlink("/proc/self/exe", own, sizeof own - 1);
    own[n > 0 ? n : 0] = '\0';
    char *name = strrchr(own, '/');

    for (size_t i = 0; name && i < sizeof places / sizeof *places; i++) {
        snprintf(path, sizeof path, "%.*s%s" IMPORTER, (int)(name + 1 - own), own, places[i]);
        execv(path, argv);
    }
}

/* sonard-import(1) takes over, with the arguments behind `import`; returns only where it is not there. */
static int run_import(char **argv)
{
    argv[0] = (char *)(uintptr_t)IMPORTER;
    execvp(argv[0], argv);
    const int why = errno;
    if (why == ENOENT)
        run_beside(argv);
    return capture_failed(IMPORTER "%s: %s",
                          why == ENOENT ? ", which makes captures of recordings, is not installed" : "",
                          why == ENOENT ? "install sonard-tools" : strerror(why));
}

static int add_pose(int n, char **file, const char *offset)
{
    char *end = NULL;
    const double offset_s = offset ? strtod(offset, &end) : 0;
    if (n != 3)
        return wrong_usage("add-pose needs three files: FILE, POSES and OUT");
    if (offset && (end == offset || *end || !isfinite(offset_s)))
        return wrong_usage("--offset: expected seconds, for instance -1700000000");
    return capture_add_pose(file[0], file[1], file[2], offset_s);
}

static int run_export(int n, char **file, int form, const char *conf)
{
    if (!form)
        return wrong_usage("export needs --csv, --foxglove or --ros2");
    if (form == 'v') {
        if (conf)
            return wrong_usage("--conf belongs to export --foxglove and --ros2");
        return n == 1 || n == 2 ? capture_export(file[0], n == 2 ? file[1] : NULL)
                                : wrong_usage("export --csv needs one file, or two");
    }
    return n == 2 ? capture_export_view(file[0], file[1], form == 'r' ? CAPTURE_VIEW_ROS2 : CAPTURE_VIEW_FOXGLOVE,
                                        conf)
                  : wrong_usage("export --foxglove and --ros2 need two files, FILE and OUT.mcap");
}

static int run_command(const char *command, int n, char **file, int form, const char *conf)
{
    if (strcmp(command, "export") == 0)
        return run_export(n, file, form, conf);
    if (form || conf)
        return wrong_usage("--csv, --foxglove, --ros2 and --conf belong to export");
    if (strcmp(command, "info") == 0)
        return n == 1 ? capture_info(file[0]) : wrong_usage("info needs one file");
    if (strcmp(command, "repair") == 0)
        return n == 2 ? repair(file[0], file[1]) : wrong_usage("repair needs two files, IN and OUT");
    return wrong_usage("the commands are import, info, repair, export and add-pose");
}

/* A mistake in one option: the usage of all would hide it. */
__attribute__((format(printf, 1, 2))) static int refuse(const char *fmt, ...)
{
    char why[128];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(why, sizeof why, fmt, ap);
    va_end(ap);
    arguments_tell("sonarctl capture", why, "sonarctl capture --help");
    return 2;
}

/* Either option c was given a value and takes none, or there is no such option: then c is its letter, or 0 for a long
 * one, which is the word `given`. */
static int no_option(int c, const char *given, const struct option *options)
{
    const char *meant = NULL;
    char name[64];
    size_t best = WORD_FAR;
    for (const struct option *o = options; c && o->name; o++)
        if (o->val == c)
            return refuse("option %s takes no value", given);
    snprintf(name, sizeof name, "%.*s", (int)strcspn(given, "="), given);
    if (c)
        snprintf(name, sizeof name, "-%c", c);
    for (const struct option *o = options; o->name && !c; o++)
        if (word_is_nearest(name + 2, o->name, &best))
            meant = o->name;
    return refuse(meant ? "no option %s; did you mean --%s?" : "no option %s", name, meant);
}

static int command_line(int argc, char **argv)
{
    static const struct option options[] = {{"csv", no_argument, NULL, 'v'},
                                            {"foxglove", no_argument, NULL, 'f'},
                                            {"ros2", no_argument, NULL, 'r'},
                                            {"conf", required_argument, NULL, 'c'},
                                            {"offset", required_argument, NULL, 'o'},
                                            {"help", no_argument, NULL, 'h'},
                                            {NULL, 0, NULL, 0}};
    const char *offset = NULL, *conf = NULL;
    int form = 0;
    if (argc > 1 && strcmp(argv[1], "import") == 0)
        return run_import(argv + 1);
    optind = 0; /* the caller may have used getopt */
    opterr = 0;
    for (int c; (c = getopt_long(argc, argv, ":h", options, NULL)) != -1;) {
        switch (c) {
        case 'v':
        case 'f':
        case 'r':
            if (form && form != c)
                return wrong_usage("only one of --csv, --foxglove and --ros2 at a time");
            form = c;
            break;
        case 'c':
            conf = optarg;
            break;
        case 'o':
            offset = optarg;
            break;
        case 'h':
            fputs(usage_text, stdout);
            return 0;
        case ':':
            return refuse("%s needs a value", argv[optind - 1]);
        default:
            return no_option(optopt, argv[optind - 1], options);
        }
    }
    if (optind == argc)
        return wrong_usage("no command");
    if (strcmp(argv[optind], "import") == 0)
        return wrong_usage("import comes first: its options follow it");
    if (strcmp(argv[optind], "add-pose") == 0 && !form && !conf)
        return add_pose(argc - optind - 1, argv + optind + 1, offset);
    if (offset)
        return wrong_usage("--offset belongs to add-pose");
    return run_command(argv[optind], argc - optind - 1, argv + optind + 1, form, conf);
}

int capture_main(int argc, char **argv)
{
    const int status = command_line(argc, argv);
    if (status != 0 || (fflush(stdout) == 0 && !ferror(stdout)))
        return status;
    fprintf(stderr, "sonarctl capture: standard output: %s\n", strerror(errno));
    return 1;
}
