#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Completion of sonarctl: what it offers is what the commands, the protocol and the daemon have; bash and zsh hand it on."""
import os
import pty
import re
import select
import shutil
import subprocess
import time

from lib import PATIENCE, SCHEMAS, SONARCTL, Skipped, check, run, until

TOP = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))
DEFS = SCHEMAS.document["$defs"]


def offered(bench, *words):
    out = bench.run(SONARCTL, "complete", "--", *words)
    check(out.returncode == 0 and not out.stderr, "%s: %s" % (words, out.stderr))
    return [line.split("\t")[0] for line in out.stdout.splitlines()]


def commands(bench):
    """Every command and every option that the help tells, and no other."""
    told = re.findall(r"^  ([a-z_]+) ", bench.run(SONARCTL, "--help").stdout, re.M)
    check(offered(bench, "") == told + ["help"], "commands: %s" % offered(bench, ""))
    for command in told[:-1]:
        options = re.findall(r"^  (-\S+)", bench.run(SONARCTL, command, "--help").stdout, re.M)
        got = offered(bench, command, "-")
        check([o for o in got if o != "-h"] == options, "%s: %s and %s" % (command, got, options))


def helps(bench):
    """help COMMAND is COMMAND --help, of every command; what draws has no result to print with --json."""
    whole = bench.run(SONARCTL, "--help").stdout
    for word in re.findall(r"^  ([a-z_]+) ", whole, re.M) + ["complete"]:
        told = bench.run(SONARCTL, word, "--help")
        check(told.returncode == 0 and told.stdout.startswith("usage: sonarctl") and "(null)" not in told.stdout, told.stdout)
        check(bench.run(SONARCTL, "help", word).stdout == told.stdout, "help " + word)
        for choices in (p["enum"] for p in SCHEMAS.document["$defs"].get(word + ".params", {"properties": {}})["properties"].values() if "enum" in p):
            check("|".join(choices[:2]) not in told.stdout or "|".join(choices) + " " in told.stdout, "words are cut off: " + told.stdout)
        check(word == "capture" or ("--json" in told.stdout) == (word not in ("top", "plot")), told.stdout)
    for words in (("help",), ("help", "help"), ("help", "--help"), ("-h",)):
        check(bench.run(SONARCTL, *words).stdout == whole, " ".join(words))
    for words in (("top", "--once", "--json"), ("--json", "plot", "-o", bench.path("x"))):
        out = bench.run(SONARCTL, *words)
        check(out.returncode == 3 and "no option --json" in out.stderr, "%s: %s" % (words, out.stderr))
    out = bench.run(SONARCTL, "--socket", "/" + 199 * "x", "status")
    check(out.returncode == 4 and "has 1 to 107 bytes, this one has 200" in out.stderr, out.stderr)


def protocol(bench):
    """Every method of the protocol, and its parameters."""
    methods = sorted(name[:-len(".params")] for name in DEFS if name.endswith(".params"))
    got = offered(bench, "call", "")
    check(sorted(got) == methods, "methods differ by %s" % (set(methods) ^ set(got)))
    for method in methods:
        keys = sorted(DEFS[method + ".params"].get("properties", {}))
        check(sorted(offered(bench, "watch", method, "")) == [key + "=" for key in keys], "%s: expected %s" % (method, keys))


def options(bench):
    """Every parameter of a method is an option of its command, with its default."""
    common = 4  # --json, --socket, --timeout, --help
    for command in ("sectors", "nearest", "limit", "time_to_collision", "clusters", "next_look", "pose"):
        told = re.findall(r"^  --(\S+) (.*)", bench.run(SONARCTL, command, "--help").stdout, re.M)
        params = DEFS[command + ".params"]
        own = {"pose": 2}.get(command, 0)  # --rate, --withdraw
        check(len(told) - common - own == len(params["properties"]), "%s: %s" % (command, told))
        for key, one in params["properties"].items():
            flag = "time" if key == "t_unix" else re.sub("_(deg|m|mps|s|hz)$", "", key).replace("_", "-")
            line = dict(told)[flag]
            default = one.get("default", "")
            shown = ",".join(str(v) for v in default) if isinstance(default, list) else str(default)
            check(shown == "" or line.endswith("(%s)" % shown), "%s %s: %s" % (command, flag, line))
            check(("must be given" in line) == (key in params["required"]), "%s %s: %s" % (command, flag, line))


CASES = (
    (("bl",), ["blocked"]),
    (("--json", "bl"), ["blocked"]),
    (("--timeout", "3", "bl"), ["blocked"]),
    (("help", "st"), ["status", "stats"]),
    (("blocked", "30", "--dist"), ["--distance"]),
    (("blocked", "-30", "--frame", ""), ["body", "ned"]),
    (("point", "--frame", "n"), ["ned"]),
    (("map", "export", "x", "--format", ""), ["ply", "mcap", "bt"]),
    (("map", ""), ["status", "draw", "new", "forget", "save", "load", "export"]),
    (("grid", "l"), ["list", "lock"]),
    (("grid", "e"), ["export"]),
    (("background", "f"), ["forget"]),
    (("capture", ""), ["import", "info", "repair", "export", "add-pose"]),
    (("watch", "sectors", "fr"), ["frame="]),
    (("watch", "sectors", "count=4", "fr"), ["frame="]),
    (("blocked", "30", "--distance", ""), []),
    (("nonsense", ""), []),
    (("map", "load", ""), []),
)


def words(bench):
    for given, want in CASES:
        check(offered(bench, "--socket", bench.path("none"), *given) == want, "%s: %s" % (given, offered(bench, *given)))
    check(offered(bench) == offered(bench, ""), "nothing at all")


def names(bench):
    """Of grids, sonars and maps, as the daemon has them."""
    bench.sim()
    bench.conf(map={"voxel": "0.2 m", "memory": "8 MiB", "directory": bench.folder}, **{"grid far": {"range": "60 m"}})
    bench.sonard().client().close()
    check(bench.sonarctl("map", "save", "basin").returncode == 0, "a map")
    here = ("--socket", bench.socket_path)
    check(offered(bench, *here, "map", "load", "") == ["basin"], "maps")
    check(offered(bench, *here, "map", "forget", "") == [], "forget takes no name")
    check(offered(bench, *here, "sectors", "--grid", "f") == ["far"], "grids")
    check(offered(bench, *here, "plot", "--sensor", "") == ["head"], "sonars")


def bash(bench):
    """The function, with the line as bash hands it over."""
    script = "source %s/completion/sonarctl.bash; COMP_LINE=$1 COMP_POINT=${#1}; _sonarctl sonarctl; printf '%%s\\n' \"${COMPREPLY[@]}\"" % TOP
    for line, want in (("sonarctl bl", ["blocked"]), ("sonarctl map l", ["load"]), ("sonarctl watch sectors fr", ["frame="]),
                       ("sonarctl point --frame ", ["ned", "body"]), ("sonarctl nonsense ", [])):
        done = subprocess.run(["bash", "-c", script, "bash", line.replace("sonarctl", SONARCTL)], capture_output=True, text=True,
                              check=False)
        check(done.stdout.split() == want, "%s: %s %s" % (line, done.stdout, done.stderr))


def programs(bench):
    """The other programs: every option that their help tells, at the start of a line as a program beside this file."""
    script = "source %s/completion/options.bash; _sonard_options \"$1\" \"$2\"; printf '%%s\\n' \"${COMPREPLY[@]}\"" % TOP
    tools = [os.path.join(os.path.dirname(SONARCTL), name) for name in ("sonard", "sonard-mavlink", "sonard-web")]
    for program in tools + [os.path.join(TOP, "python", name) for name in ("sonard-tune", "sonard-import", "sonard-poses", "sonard-rosbag", "sonard-report")]:
        told = set(re.findall(r"^ +(?:-\w, )?(--[a-z-]+)", bench.run(program, "--help").stdout, re.M))
        done = subprocess.run(["bash", "-c", script, "bash", program, "--"], capture_output=True, text=True, check=False)
        check(len(told) >= 3 and set(done.stdout.split()) == told, "%s: %s %s" % (program, done.stdout, done.stderr))


def typed(shell, setup, keys, want):
    """Types into an interactive shell until it shows what is wanted."""
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ.update(TERM="dumb", PATH=os.path.dirname(SONARCTL) + ":" + os.environ["PATH"])
        os.execvp(shell[0], shell)
    seen = b""
    try:
        def read(pattern, what):
            nonlocal seen
            end = time.monotonic() + 20 * PATIENCE
            while not re.search(pattern, seen):
                check(time.monotonic() < end, "%s: %s in %r" % (shell[0], what, seen))
                if select.select([terminal], [], [], 0.1)[0]:
                    seen += os.read(terminal, 65536)
        for line in setup:
            os.write(terminal, line.encode() + b"\n")
        os.write(terminal, b"echo rea''dy\n")
        read(rb"\nready", "its prompt")
        seen = b""
        os.write(terminal, keys.encode() + b"\t")
        read(want, "what it completes")
    finally:
        os.write(terminal, b"\x03\x04")
        os.close(terminal)
        until(lambda: os.waitpid(pid, os.WNOHANG)[0] == pid, "%s ends" % shell[0])


def shells(bench):
    """As a person has it: typed, and completed by tab."""
    typed(["bash", "--norc", "--noprofile"], ["source %s/completion/sonarctl.bash" % TOP], "sonarctl time_", rb"time_to_collision")
    if not shutil.which("zsh"):
        raise Skipped("zsh is not installed")
    zsh = ["fpath=(%s/completion $fpath)" % TOP, "autoload -U compinit; compinit -D -u"]
    typed(["zsh", "-f"], zsh, "sonarctl time_", rb"time_to_collision")
    typed(["zsh", "-f"], zsh, "sonard-mavlink --bar", rb"ometer")
    typed(["zsh", "-f"], zsh, "sonarctl watch sectors elev", rb"elevation_deg=")


def meant(bench):
    """A command that is nearly one: which one; one that is near to none: nothing of the kind."""
    for typed_word, command in (("bloked", "blocked"), ("sttaus", "status"), ("captur", "capture")):
        said = bench.run(SONARCTL, typed_word)
        check(said.returncode == 3 and "did you mean %s?" % command in said.stderr, said.stderr)
    said = bench.run(SONARCTL, "zzzzzz")
    check(said.returncode == 3 and "no command 'zzzzzz'; see" in said.stderr, said.stderr)


run([("completion_" + f.__name__, f) for f in (commands, helps, options, meant, protocol, words, names, bash, programs, shells)],
    gate=("completion_commands", "completion_helps", "completion_options", "completion_meant", "completion_protocol", "completion_words", "completion_bash", "completion_programs"))
