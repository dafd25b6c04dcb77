#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""mutants.py - does a unit test notice when grid/ is wrong? Changes one place of the source, compiles that file, links it
before the archives into the unit tests that use it, and runs them until one fails.

  --sample N    N changes drawn at random from all that the operators below can make (default 60)
  --named       only the changes that named.txt lists, each of which a test is written for
  --seed S      of the draw; printed (SONARD_SEED has the same effect)
  --only PATH   only files whose name begins so
  --list        print the changes, make none

Operators: relational (< to <=, == to !=), arithmetic (+ to -, * to /), logical (&& to ||), constant (n to n + 1, 2 x),
negation (of a condition; a ! or a sign left out), function (fmin to fmax, sin to cos, floor to ceil), and a statement left
out. A change that does not compile is drawn again. One that compiles to the same code as the original changes nothing and
is not counted. A test that runs out of time notices, too.

Prints "killed N of M" and every survivor with its place; exit status 1 when a named change survives. The environment that
`make mutants` sets: MUTANTS_COMPILE, MUTANTS_LINK, MUTANTS_LIBS, MUTANTS_ARCHIVES, BUILD."""
import argparse
import glob
import os
import random
import re
import shlex
import subprocess
import sys
import tempfile
import time

BUILD = os.environ.get("BUILD", "build")
HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))
SWAPS = {  # as clang-format sets them: a binary operator has a space on either side
    "relational": {"<": ["<=", ">="], "<=": ["<", ">"], ">": [">=", "<="], ">=": [">", "<"], "==": ["!="], "!=": ["=="]},
    "arithmetic": {"+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"], "+=": ["-="], "-=": ["+="], "<<": [">>"], ">>": ["<<"],
                   "&": ["|"], "|": ["&"], "|=": ["&="], "&=": ["|="]},
    "logical": {"&&": ["||"], "||": ["&&"]},
}
WRAPPED = {"test_template.c": ["-Wl,--wrap=malloc,--wrap=calloc"],  # as the Makefile has it
           "test_query_context.c": ["-Wl,--wrap=source_stats"]}
FUNCTIONS = {"fmin": "fmax", "fmax": "fmin", "fminf": "fmaxf", "fmaxf": "fminf", "sin": "cos", "cos": "sin",
             "floor": "ceil", "ceil": "floor", "lesser": "greater", "greater": "lesser"}
NUMBER = re.compile(r"(?<![\w.])(\d+\.\d+|\d+)(e-?\d+)?([uUlLfF]*)(?![\w.])")
LEFT_OUT = re.compile(r"^\s+(?!return\b|break\b|continue\b|goto\b|case\b|else\b|if\b|for\b|while\b|do\b|static\b|const\b)"
                      r"(\+\+|--)?[\w.\->\[\]\(\)*& +]*(\(.*\)| (=|\+=|-=|\*=|/=|\|=|&=|<<=|>>=) .*|\+\+|--);$")
DECLARED = re.compile(r"^\s+(const |unsigned |struct |enum |union |double |float |u?int\d*(_t)?|size_t|bool |char |void |long )")


class Change:
    """One place of a file: text[at : at + len(old)] becomes new."""

    def __init__(self, path, text, at, old, new, kind):
        self.path, self.at, self.old, self.new, self.kind = path, at, old, new, kind
        self.line = text.count("\n", 0, at) + 1
        begin = text.rfind("\n", 0, at) + 1
        end = text.find("\n", at)
        self.before = text[begin:end].strip()
        self.after = (text[begin:at] + new + text[at + len(old):text.find("\n", at + len(old))]).strip()

    def __str__(self):
        return "%s:%d %s\n    - %s\n    + %s" % (self.path, self.line, self.kind, self.before, self.after)


def blanked(text):
    """The text with comments, strings and #include lines made blank: places stay where they are."""
    pattern = r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|^#\s*(?:include|ifndef|ifdef|if|endif|error)[^\n]*'
    return re.sub(pattern, lambda m: re.sub(r"[^\n]", " ", m.group()), text, flags=re.S | re.M)


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
        for m in re.finditer(r"(?<=[\w)\]] )([-+*/<>=!&|]+)(?= \S)", bare):
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

    def __init__(self, folder):
        self.folder = folder
        self.archives = words("MUTANTS_ARCHIVES")
        self.original = {}  # path: its code, to see what changes nothing
        self.tests = {}     # test: its object file
        self.traced = {}    # test: what the linker took for it
        self.took = {}      # test: seconds of its run with nothing changed; None: it fails
        for source in glob.glob("tests/unit/**/test_*.c", recursive=True):
            self.tests[source] = os.path.join(BUILD, source[:-2] + ".o")

    def compile(self, path, text):
        """The object file of this text in place of the file's; None: it does not compile."""
        source = os.path.join(self.folder, "mutant.c")
        out = os.path.join(self.folder, "mutant.o")
        with open(source, "w", encoding="utf-8") as f:
            f.write(text)
        flags = [w for w in words("MUTANTS_COMPILE") if w not in ("-MMD", "-MP", "-g", "-Werror")]
        done = subprocess.run(flags + ["-w", "-I", os.path.dirname(path), "-iquote", os.path.dirname(path), "-c", "-o", out,
                                       source], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
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

    def link(self, source, first, out, *more):
        wrap = WRAPPED.get(os.path.basename(source), [])
        return subprocess.run(words("MUTANTS_LINK") + wrap + list(more) + ["-o", out] + first + [self.tests[source]] +
                              self.archives + words("MUTANTS_LIBS"), capture_output=True, text=True, check=False)

    def users(self, path):
        """The tests that have the file's code in them, the nearest first: of its own name, of its folder, the quickest."""
        member = re.compile(r"\.a[()]+%s\.o\b" % os.path.basename(path)[:-2])
        own = re.sub(r"^test_", "", os.path.basename(path)[:-2])
        found = [t for t in self.tests if member.search(self.members(t)) and self.seconds(t) is not None]
        return sorted(found, key=lambda t: (not os.path.basename(t)[5:].startswith(own),
                                            os.path.dirname(path) not in t, self.seconds(t)))

    def members(self, source):
        if source not in self.traced:
            program = os.path.join(self.folder, "whole")
            self.traced[source] = self.link(source, [], program, "-Wl,-t,-t").stdout
        return self.traced[source]

    def run(self, program, limit):
        try:
            done = subprocess.run(["sh", "-c", "ulimit -v 4000000; exec \"$0\"", program], stdin=subprocess.DEVNULL,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=limit, check=False)
        except subprocess.TimeoutExpired:
            return False
        return done.returncode == 0

    def seconds(self, source):
        """Of the test as it is; None: it fails or takes more than LIMIT."""
        if source not in self.took:
            begun = time.monotonic()
            good = self.run(os.path.abspath(os.path.join(BUILD, "tests", os.path.basename(source)[:-2])), self.limit)
            self.took[source] = time.monotonic() - begun if good else None
        return self.took[source]

    def killer(self, path, obj):
        """The test that notices, or None."""
        program = os.path.join(self.folder, "program")
        for test in self.users(path):
            if self.link(test, [obj], program).returncode:
                continue
            if not self.run(program, 10 + 5 * self.seconds(test)):
                return os.path.basename(test)[:-2]
        return None


def mutated(change):
    text = open(change.path, encoding="utf-8").read()
    return text[:change.at] + change.new + text[change.at + len(change.old):]


def judge(bench, change):
    """The verdict on a change: a test's name, "survives", "the same", or None where it does not compile."""
    obj = bench.compile(change.path, mutated(change))
    if not obj:
        return None
    if bench.changes_nothing(change.path, obj):
        return "the same"
    return bench.killer(change.path, obj) or "survives"


def score(bench, changes, wanted):
    killed, survivors, same = 0, [], 0
    for change in changes:
        if killed + len(survivors) == wanted:
            break
        verdict = judge(bench, change)
        if verdict == "survives":
            survivors.append(change)
            print("SURVIVES %s" % change, flush=True)
        elif verdict == "the same":
            same += 1
        elif verdict:
            killed += 1
            print("killed by %-28s %s:%d %s" % (verdict, change.path, change.line, change.kind), flush=True)
    return killed, survivors, same


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--sample", type=int, default=60)
    args.add_argument("--named", action="store_true")
    args.add_argument("--seed", type=int, default=int(os.environ.get("SONARD_SEED", "1")))
    args.add_argument("--only", default="")
    args.add_argument("--limit", type=float, default=60, help="seconds: slower tests do not take part (default 60)")
    args.add_argument("--list", action="store_true")
    args = args.parse_args()
    os.chdir(TOP)
    if args.named:
        changes = [c for c in named_changes() if c.path.startswith(args.only)]
    else:
        changes = [c for path in sorted(glob.glob("grid/**/*.c", recursive=True)) if path.startswith(args.only)
                   for c in changes_of(path)]
        print("seed %d: %d of %d changes" % (args.seed, args.sample, len(changes)), flush=True)
        random.Random(args.seed).shuffle(changes)
    if args.list:
        print("\n".join(map(str, changes if args.named else changes[:args.sample])))
        if args.named:
            print("ok mutants_named_are_in_their_files")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(folder)
        bench.limit = args.limit
        killed, survivors, same = score(bench, changes, len(changes) if args.named else args.sample)
    total = killed + len(survivors)
    print("killed %d of %d (%.1f %%), %d more change nothing" % (killed, total, 100.0 * killed / total if total else 0, same))
    return 1 if args.named and survivors else 0


if __name__ == "__main__":
    sys.exit(main())
