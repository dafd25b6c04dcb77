#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""mutants.py - does a test notice when the code is wrong? Changes one place of a .c file in grid/, drivers/ or daemon/, compiles
it, links it before the archives into the unit tests (rig tests too) that use it, and runs them until one fails. What none of
them notices goes into sonard and through the box's golden replay (tests/replay/box.sh), the last judge.

  --sample N    N changes of each of the three, drawn at random from all that the operators below can make (default 60)
  --named       only the changes that named.txt lists, each of which a test is written for
  --seed S      of the draw; printed (SONARD_SEED has the same effect)
  --only PATH   only files whose name begins so
  --limit S     tests that take longer than so many seconds are not asked (default 60)
  --list        print the changes, make none

Operators: relational (< to <=, == to !=), arithmetic (+ to -, * to /), logical (&& to ||), constant (n to n + 1, 2 x),
negation (of a condition; a ! or a sign left out), function (fmin to fmax, sin to cos, floor to ceil), and left out: a term of
a sum, a condition of && or ||, a statement. A change that does not compile is drawn again. One that compiles to the same code
as the original changes nothing and is not counted. A test that runs out of time notices, too. Headers are never changed, and
voyages and live tests never asked.

Prints every survivor with its place, the score of every folder, and what was skipped: tests that were not asked, cases that
the tests themselves skip here. Exit status 1 when a named change survives. The environment that `make mutants` sets:
MUTANTS_COMPILE, MUTANTS_LINK, MUTANTS_LIBS, MUTANTS_ARCHIVES, MUTANTS_WRAPS, BUILD."""
import argparse
import glob
import os
import random
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time

BUILD = os.environ.get("BUILD", "build")
FOLDERS = ("grid", "drivers", "daemon")
HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))
SWAPS = {  # as clang-format sets them: a binary operator has a space on either side
    "relational": {"<": ["<=", ">="], "<=": ["<", ">"], ">": [">=", "<="], ">=": [">", "<"], "==": ["!="], "!=": ["=="]},
    "arithmetic": {"+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"], "+=": ["-="], "-=": ["+="], "<<": [">>"], ">>": ["<<"],
                   "&": ["|"], "|": ["&"], "|=": ["&="], "&=": ["|="]},
    "logical": {"&&": ["||"], "||": ["&&"]},
}
FUNCTIONS = {"fmin": "fmax", "fmax": "fmin", "fminf": "fmaxf", "fmaxf": "fminf", "sin": "cos", "cos": "sin",
             "floor": "ceil", "ceil": "floor", "lesser": "greater", "greater": "lesser"}
NUMBER = re.compile(r"(?<![\w.])(\d+\.\d+|\d+)(e-?\d+)?([uUlLfF]*)(?![\w.])")
LEFT_OUT = re.compile(r"^\s+(?!\s|return\b|break\b|continue\b|goto\b|case\b|else\b|if\b|for\b|while\b|do\b|static\b|const\b)"
                      r"(\+\+|--)?[\w.\->\[\]\(\)*& +]*(\(.*\)| (=|\+=|-=|\*=|/=|\|=|&=|<<=|>>=) .*|\+\+|--);$")
DECLARED = re.compile(r"^\s+(const |unsigned |struct |enum |union |double |float |u?int\d*(_t)?|size_t|bool |char |void |long )")


class Change:
    """One place of a file: text[at : at + len(old)] becomes new."""

    def __init__(self, path, text, at, old, new, kind):
        self.path, self.at, self.old, self.new, self.kind = path, at, old, new, kind
        self.line = text.count("\n", 0, at) + 1
        begin = text.rfind("\n", 0, at) + 1
        end = text.find("\n", at + len(old))
        self.before = " ".join(text[begin:end].split())
        self.after = " ".join((text[begin:at] + new + text[at + len(old):end]).split())

    def __str__(self):
        return "%s:%d %s\n    - %s\n    + %s" % (self.path, self.line, self.kind, self.before, self.after)


def blanked(text):
    """The text with comments, strings and #include lines made blank: places stay where they are."""
    pattern = r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|^#\s*(?:include|ifndef|ifdef|if|endif|error)[^\n]*'
    return re.sub(pattern, lambda m: re.sub(r"[^\n]", " ", m.group()), text, flags=re.S | re.M)


SPACED = re.compile(r"(?<=\s)[-+*/%<>=!&|^?:]+(?=\s)")  # a binary operator, as clang-format sets it
TERM_ENDS = re.compile(r"[^*/%]*")                       # one that binds no closer than + does
CONDITION_ENDS = re.compile(r"&&|\|\||[?:]|(?![=!<>]=)[^=]*=$")


def walk(bare, at, step, ends):
    """Where the operand that goes from here in this direction ends: at a bracket around it, or at a place of `ends`."""
    deep = 0
    while 0 <= at < len(bare):
        c = bare[at]
        deep += step * ((c in "([") - (c in ")]"))
        if deep < 0 or (deep == 0 and (c in ",;?:{}" or at in ends)):
            return at
        at += step
    return at


def terms_left_out(bare):
    """(from, to, in its place, kind) of every term of a sum and every condition of && and ||."""
    spaced = list(SPACED.finditer(bare))
    for kind, wanted, last in (("term left out", "+ -", TERM_ENDS), ("condition left out", "&& ||", CONDITION_ENDS)):
        wanted = wanted.split()
        ends = {at: m.group() for m in spaced if last.fullmatch(m.group()) for at in range(m.start(), m.end())}
        for m in spaced:
            if m.group() not in wanted:
                continue
            to = walk(bare, m.end(), 1, ends)
            yield m.start() - 1, to, "", kind
            before = walk(bare, m.start() - 1, -1, ends)
            if ends.get(before) in wanted:
                continue  # that operator's right side
            begin = before + 1 + len(re.match(r"\s*(?:(?:return|case|else)\b)?\s*", bare[before + 1:m.start()]).group())
            after = m.end() + len(re.match(r"\s*", bare[m.end():]).group())
            yield begin, after, "-" if m.group() == "-" else "", kind


def number_changes(m):
    digits, exponent, suffix = m.group(1), m.group(2) or "", m.group(3)
    if "." in digits or exponent:
        return ["(2 * %s)" % m.group(), "(0.5 * %s)" % m.group()]
    return ["%d%s" % (int(digits) + 1, suffix)] + (["%d%s" % (int(digits) - 1, suffix)] if int(digits) else [])


def changes_of(path):
    """All changes that the operators make in a file."""
    text = open(path, encoding="utf-8").read()
    bare = blanked(text)
    out = []

    def add(at, old, new, kind):
        out.append(Change(path, text, at, old, new, kind))

    for kind, swaps in SWAPS.items():
        for m in re.finditer(r"(?<=[\w)\]] )([-+*/<>=!&|]+)(?=\s)", bare):
            for new in swaps.get(m.group(1), []):
                add(m.start(1), m.group(1), new, kind)
    for m in NUMBER.finditer(bare):
        for new in number_changes(m):
            add(m.start(), m.group(), new, "constant")
    for m in re.finditer(r"\b(%s)(?=\()" % "|".join(FUNCTIONS), bare):
        add(m.start(), m.group(), FUNCTIONS[m.group()], "function")
    for m in re.finditer(r"(?<=[(=,] )-(?=[\w(])|(?<=\()-(?=[\w(])|(?<=return )-(?=[\w(])|!(?=[\w(])", bare):
        add(m.start(), m.group(), "", "negation")
    for m in re.finditer(r"\b(?:if|while) \(([^;{}]*?)\)(?=\n|( \{)?\n)", bare):
        add(m.start(1), text[m.start(1):m.end(1)], "!(%s)" % text[m.start(1):m.end(1)], "negation")
    for begin, end, new, kind in terms_left_out(bare):
        add(begin, text[begin:end], new, kind)
    at = 0
    for line in bare.split("\n"):
        if LEFT_OUT.match(line) and not DECLARED.match(line):
            begin = at + len(line) - len(line.lstrip())
            add(begin, text[begin:at + len(line)], "(void)0;", "statement left out")
        at += len(line) + 1
    return out


def named_changes():
    """named.txt: blocks of PATH, a line "- old", a line "+ new"; the old one stands once in the file."""
    out = []
    path = old = None
    for number, line in enumerate(open(os.path.join(HERE, "named.txt"), encoding="utf-8"), 1):
        line = line.rstrip("\n")
        if line.startswith("- "):
            old = line[2:]
        elif line.startswith("+ "):
            text = open(path, encoding="utf-8").read()
            if text.count(old) != 1:
                sys.exit("named.txt:%d: %s has this %d times, wanted once: %s" % (number, path, text.count(old), old))
            out.append(Change(path, text, text.index(old), old, line[2:], "named"))
        elif line and not line.startswith("#"):
            path = line.strip()
    return out


def words(name):
    return shlex.split(os.environ[name])


class Bench:
    """Objects and tests of this build, and a folder to make others in."""

    def __init__(self, folder, limit):
        self.folder, self.limit = folder, limit
        self.archives = words("MUTANTS_ARCHIVES")
        self.wraps = [w.split(":", 1) for w in words("MUTANTS_WRAPS")]
        self.original = {}  # path: its code, to see what changes nothing
        self.traced = {}    # test: what the linker took for it
        self.took = {}      # test: seconds of its run with nothing changed; None: it is not asked
        self.skipped = {}   # why: whom, said at the end
        self.tests = sorted(glob.glob("tests/unit/**/test_*.c", recursive=True))
        self.text = {t: open(t, encoding="utf-8").read() for t in self.tests}
        os.makedirs(os.path.join(folder, "build", "tests"))
        for program in ("sonarctl", "tests/walls"):
            os.symlink(os.path.abspath(os.path.join(BUILD, program)), os.path.join(folder, "build", program))
        self.sonard = self.traced_link(None)
        self.box = self.replays(os.path.join(BUILD, "daemon", "main.o"), None)
        if not self.box:
            self.skip("the box replay fails as it is", "tests/replay/box.sh")

    def skip(self, why, whom):
        self.skipped.setdefault(why, set()).add(whom)

    def compile(self, path, text, beside=None):
        """The object file of this text in place of the file's (which may include one beside which others lie, too); None:
        it does not compile."""
        source = os.path.join(self.folder, "mutant.c")
        out = os.path.join(self.folder, "test.o" if path.startswith("tests/") else "mutant.o")
        with open(source, "w", encoding="utf-8") as f:
            f.write(text)
        flags = [w for w in words("MUTANTS_COMPILE") if w not in ("-MMD", "-MP", "-g", "-Werror")]
        for folder in (path, beside or path):
            flags += ["-iquote", os.path.dirname(folder)]
        done = subprocess.run(flags + ["-w", "-c", "-o", out, source], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              check=False)
        return out if done.returncode == 0 else None

    def code(self, obj):
        with open(obj, "rb") as f:
            return f.read()

    def changes_nothing(self, path, obj):
        mutant = self.code(obj)
        if path not in self.original:
            same = self.compile(path, open(path, encoding="utf-8").read())
            self.original[path] = self.code(same)
            with open(obj, "wb") as f:
                f.write(mutant)
        return mutant == self.original[path]

    def link(self, objects, out, *more):
        return subprocess.run(words("MUTANTS_LINK") + ["-Wl,-s"] + list(more) + ["-o", out] + objects + self.archives +
                              words("MUTANTS_LIBS"), capture_output=True, text=True, check=False)

    def traced_link(self, test):
        """What the linker takes for a test, or for sonard."""
        objects = [os.path.join(BUILD, test[:-2] + ".o" if test else "daemon/main.o")]
        return self.link(objects, os.path.join(self.folder, "whole"), "-Wl,-t,-t", *self.wraps_of(test)).stdout

    def wraps_of(self, test):
        return [flag for name, flag in self.wraps if test and name == os.path.basename(test)[:-2]]

    def uses(self, test, path):
        """Has the test, or sonard, the file's code in it?"""
        if test and test not in self.traced:
            self.traced[test] = self.traced_link(test)
        member = r"lib%s\.a[()]+%s\.o\b" % (path.split("/")[0], os.path.basename(path)[:-2])
        return path == "daemon/main.c" and not test or re.search(member, self.traced[test] if test else self.sonard)

    def includes(self, test, path):
        return '#include "%s"' % path in self.text[test]

    def users(self, path):
        """The tests that have the file's code in them, the nearest first: of its own name, of its folder, the quickest."""
        own = re.sub(r"^test_", "", os.path.basename(path)[:-2])
        found = [t for t in self.tests if (self.includes(t, path) or self.uses(t, path)) and self.seconds(t) is not None]
        return sorted(found, key=lambda t: (not os.path.basename(t)[5:].startswith(own),
                                            os.path.dirname(path) not in t, self.seconds(t)))

    def run(self, command, limit):
        """Its exit status and what it said; what hangs is ended, with all that it started."""
        with subprocess.Popen(["sh", "-c", 'ulimit -v 4000000; exec "$0" "$@"'] + command, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True,
                              env={**os.environ, "BUILD": os.path.join(self.folder, "build")}) as program:
            try:
                said = program.communicate(timeout=limit)[0]
            except subprocess.TimeoutExpired:
                os.killpg(program.pid, signal.SIGKILL)
                return None, b""
        return program.returncode, said

    def seconds(self, test):
        """Of the test as it is; None: it fails or takes more than the limit."""
        if test not in self.took:
            name = os.path.basename(test)[:-2]
            begun = time.monotonic()
            status, said = self.run([os.path.abspath(os.path.join(BUILD, "tests", name))], self.limit)
            self.took[test] = time.monotonic() - begun if status == 0 else None
            if status != 0:
                self.skip("not asked, fails as it is" if status is not None else "not asked, slower than --limit", name)
            cases = len(re.findall(rb"^skip ", said, flags=re.M))
            if cases:
                self.skip("cases that skip themselves here", "%s (%d)" % (name, cases))
        return self.took[test]

    def replays(self, main, obj):
        """Does the box replay still give the golden answers? With this main.o, and an object in place of an archive's."""
        sonard = os.path.join(self.folder, "build", "sonard")
        return not self.link(([obj] if obj else []) + [main], sonard).returncode and \
            self.run(["tests/replay/box.sh"], 60)[0] == 0

    def killer(self, path, obj, text):
        """The test that notices, or None."""
        program = os.path.join(self.folder, "program")
        users = self.users(path)
        for test in users:
            name = os.path.basename(test)[:-2]
            objects = [obj, os.path.join(BUILD, test[:-2] + ".o")]
            if self.includes(test, path):
                objects = [self.compile(test, self.text[test].replace('#include "%s"' % path, text), path)]
            if None in objects or self.link(objects, program, *self.wraps_of(test)).returncode:
                self.skip("not asked, does not link with a change", "%s (%s)" % (name, path))
            elif self.run([program], 10 + 5 * self.seconds(test))[0] != 0:
                return name
        if not users:
            self.skip("in no unit test that is asked", path)
        if not self.box or not self.uses(None, path):
            return None
        main = os.path.join(BUILD, "daemon", "main.o")
        good = self.replays(obj, None) if path == "daemon/main.c" else self.replays(main, obj)
        return None if good else "the box replay"


def mutated(change):
    text = open(change.path, encoding="utf-8").read()
    return text[:change.at] + change.new + text[change.at + len(change.old):]


def judge(bench, change):
    """The verdict on a change: a test's name, "survives", "the same", or None where it does not compile."""
    text = mutated(change)
    obj = bench.compile(change.path, text)
    if not obj:
        return None
    if bench.changes_nothing(change.path, obj):
        return "the same"
    return bench.killer(change.path, obj, text) or "survives"


class Score:
    """Of every folder: changes noticed, not noticed, and without effect."""

    def __init__(self):
        self.of = {}

    def add(self, bench, changes, wanted):
        """Judges changes until so many had an effect."""
        for change in changes:
            if wanted == 0:
                break
            verdict = judge(bench, change)
            if not verdict:
                continue
            wanted -= verdict != "the same"
            counted = "same" if verdict == "the same" else "survive" if verdict == "survives" else "killed"
            self.of.setdefault(os.path.dirname(change.path), {"killed": 0, "survive": 0, "same": 0})[counted] += 1
            if counted == "survive":
                print("SURVIVES %s" % change, flush=True)
            elif counted == "killed":
                print("killed by %-28s %s:%d %s" % (verdict, change.path, change.line, change.kind), flush=True)

    def print(self):
        rows = sorted(self.of.items())
        for top in FOLDERS + ("",):
            of_top = [counts for folder, counts in self.of.items() if folder.startswith(top)]
            rows.append(((top + " in all").strip(), {k: sum(c[k] for c in of_top) for k in ("killed", "survive", "same")}))
        print("%-20s %6s %6s %7s   more change nothing" % ("folder", "killed", "of", "score"))
        for folder, c in rows:
            total = c["killed"] + c["survive"]
            if total:
                print("%-20s %6d %6d %5.1f %%   %d" % (folder, c["killed"], total, 100.0 * c["killed"] / total, c["same"]))

    def survivors(self):
        return sum(c["survive"] for c in self.of.values())


def drawn(args):
    """Of each folder its changes, in the order of the draw."""
    for folder in FOLDERS:
        changes = [c for path in sorted(glob.glob(folder + "/**/*.c", recursive=True)) if path.startswith(args.only)
                   for c in changes_of(path)]
        if changes:
            print("seed %d: %d of %d changes of %s" % (args.seed, args.sample, len(changes), folder), flush=True)
            random.Random(args.seed).shuffle(changes)
            yield changes


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--sample", type=int, default=60)
    args.add_argument("--named", action="store_true")
    args.add_argument("--seed", type=int, default=int(os.environ.get("SONARD_SEED", "1")))
    args.add_argument("--only", default="")
    args.add_argument("--limit", type=float, default=60)
    args.add_argument("--list", action="store_true")
    args = args.parse_args()
    os.chdir(TOP)
    draws = [[c for c in named_changes() if c.path.startswith(args.only)]] if args.named else list(drawn(args))
    if args.list:
        for changes in draws:
            print("\n".join(map(str, changes if args.named else changes[:args.sample])))
        if args.named:
            print("ok mutants_named_are_in_their_files")
        return 0
    score = Score()
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(folder, args.limit)
        for changes in draws:
            score.add(bench, changes, len(changes) if args.named else args.sample)
    score.print()
    for why, whom in sorted(bench.skipped.items()):
        print("%s: %s" % (why, ", ".join(sorted(whom))))
    return 1 if args.named and score.survivors() else 0


if __name__ == "__main__":
    sys.exit(main())
