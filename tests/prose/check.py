#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What people read is plain English: README, docs/, the manual pages, the comments of sonard.conf, the messages.

  tests/prose/check.py [FILE...]     files and manual pages to look at instead of all

textlint (from npm, pinned in package-lock.json, installed once below BUILD) finds the words that glossary.yml refuses,
and words written twice. hunspell spells; words.txt has the project's own words. No sentence has more than 40 words; in
README and docs/ half of them have at most 18, and the first screen says what the page is for and shows something to
type. Skips where npm or hunspell is missing."""

import concurrent.futures
import filecmp
import hashlib
import json
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys

import text

LONGEST, MEDIAN, SCREEN = 40, 18, 40
KEPT_MOST = 1000  # texts whose findings are remembered
TREE = pathlib.Path(__file__).resolve().parents[2]
HERE = TREE / "tests/prose"
WORK = TREE / os.environ.get("BUILD", "build") / "prose"


def skip(why):
    print("skip prose:", why)
    sys.exit(0)


def install():
    """The linter below BUILD, as package-lock.json has it. Needs a network the first time only."""
    modules, lock = WORK / "node_modules", WORK / "package-lock.json"
    if modules.is_dir() and lock.is_file() and filecmp.cmp(lock, HERE / "package-lock.json", shallow=False):
        return
    if not shutil.which("npm"):
        skip("needs node and npm")
    WORK.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(modules, ignore_errors=True)
    lock.unlink(missing_ok=True)
    shutil.copy(HERE / "package.json", WORK)
    try: # the lock is copied in last: without it an installation that broke off counts as none
        scratch = WORK / "install"
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir()
        for name in ("package.json", "package-lock.json"):
            shutil.copy(HERE / name, scratch)
        subprocess.run(["npm", "ci", "--silent", "--no-audit", "--no-fund"], cwd=scratch, check=True, timeout=240, capture_output=True)
        (scratch / "node_modules").rename(modules)
        shutil.copy(HERE / "package-lock.json", lock)
        shutil.rmtree(scratch)
    except (OSError, subprocess.SubprocessError):
        skip("npm cannot get textlint")


def pages(arguments):
    """(name, Markdown file, its kind) of all that is read."""
    out = WORK / "text"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)

    def written(name, content):
        path = out / (name.replace("/", "-") + ".md")
        path.write_text(content)
        return path

    markdown = ["README.md", "CONTRIBUTING.md", "SECURITY.md", *sorted(str(p.relative_to(TREE)) for p in TREE.glob("docs/**/*.md"))]
    for name in markdown:
        yield name, TREE / name, "page" if name not in ("CONTRIBUTING.md", "SECURITY.md") else "text"
    for path in sorted(TREE.glob("docs/*.[1-8]")) + sorted(TREE.glob("docs/*.in")):
        yield str(path.relative_to(TREE)), written(path.name, text.from_man(path.read_text())), "text"
    yield "config/sonard.conf", written("sonard.conf", text.from_configuration((TREE / "config/sonard.conf").read_text())), "text"
    # the texts of conf_table.c are those of sonard.conf
    for folder in ("config", "drivers", "daemon", "client", "web", "grid"):
        said = "".join(text.messages(p.read_text()) + "\n" for p in sorted(TREE.glob(folder + "/**/*.c")) if p.name != "conf_table.c")
        yield "messages of " + folder, written("messages-" + folder, said), "messages"


def textlint(paths):
    """What textlint finds, by file."""
    run = subprocess.run([WORK / "node_modules/.bin/textlint", "--config", WORK / "textlintrc.json", "--format", "json", *paths],
                         cwd=WORK, capture_output=True, text=True, check=False)
    if run.returncode not in (0, 1):
        sys.exit("FAIL prose: textlint: " + (run.stderr or run.stdout).strip())
    return {pathlib.Path(one["filePath"]).resolve(): one["messages"] for one in json.loads(run.stdout or "[]")}


def linted(paths):
    """The same, from the last run for a file that is as it was then, under the same rules; the others on all processors."""
    rules = b"".join(p.read_bytes() for p in (HERE / "glossary.yml", HERE / "package-lock.json", WORK / "textlintrc.json"))
    keys = {path.resolve(): hashlib.sha256(rules + path.read_bytes()).hexdigest() for path in paths}
    kept = WORK / "linted.json"
    try:
        known = json.loads(kept.read_text())
    except (OSError, ValueError):
        known = {}
    new = sorted((path for path, key in keys.items() if key not in known), key=lambda path: -path.stat().st_size)
    parts = [part for k in range(os.cpu_count() or 1) if (part := new[k::os.cpu_count() or 1])]
    with concurrent.futures.ThreadPoolExecutor() as pool:
        for part, found in zip(parts, pool.map(textlint, parts)):
            known.update((keys[path], found.get(path, [])) for path in part)
    scratch = kept.with_suffix(".%d" % os.getpid())  # two runs at once leave one of theirs
    scratch.write_text(json.dumps(known if len(known) < KEPT_MOST else {key: known[key] for key in keys.values()}))
    scratch.rename(kept)
    return {path: known[key] for path, key in keys.items()}


def to_spell(content):
    """The words of a text, but for names of things: those with a digit, an underscore, a slash or a capital inside."""
    return {w.strip("'") for w in re.findall(r"(?<![\w/.@:-])[A-Za-z][a-z']+(?![\w/@(=]|\.\w|:\w)", content)}


def misspelt(asked):
    """Those of the words that neither hunspell nor words.txt knows."""
    run = subprocess.run(["hunspell", "-l", "-d", "en_GB", "-p", HERE / "words.txt"], input="\n".join(sorted(asked)), capture_output=True,
                         text=True, check=True)
    return set(run.stdout.split())


def first_screen(path):
    """What the first screen of a page lacks: a paragraph that says what it is for, a command to type."""
    screen = path.read_text().splitlines()[:SCREEN]
    lacks = []
    if not any(re.match(r"[A-Za-z*`\[]", line) and len(line) > 40 for line in screen[1:10]):
        lacks.append("a paragraph that says what it is for")
    if not re.search(r"^( {4,}|```)\S|`(sonard|sonarctl|sonard-\w+|make|sudo|journalctl) [^`]+`|`\w+ = [^`]+`", "\n".join(screen), re.M):
        lacks.append("something to type")
    return lacks


def main():
    if not shutil.which("hunspell") or not shutil.which("cmark-gfm"):
        skip("needs hunspell and cmark-gfm")
    install()
    (WORK / "textlintrc.json").write_text(json.dumps({"rules": {
        "prh": {"rulePaths": [str(HERE / "glossary.yml")]},
        "write-good": {"passive": False, "weasel": False, "adverb": False, "tooWordy": False, "eprime": False, "so": False,
                       "thereIs": False, "illusion": True, "cliches": True}}}))
    everything = [page for page in pages(sys.argv[1:]) if not sys.argv[1:] or page[0] in sys.argv[1:]]
    found = linted([path for _, path, _ in everything])
    read = {path: text.blocks(path) for _, path, _ in everything}
    spelt = {path: to_spell("\n".join(p for _, p in read[path])) for _, path, _ in everything}
    unknown = misspelt(set().union(*spelt.values()))
    failed = False
    for name, path, kind in everything:
        said = [s for tag, p in read[path] if tag == "paragraph" for s in text.sentences(p)]
        lengths = [len(text.words(s)) for s in said] or [0]
        median, longest = statistics.median(lengths), max(lengths)
        faults = ["%d: %s" % (m["line"], " ".join(m["message"].split())) for m in found.get(path.resolve(), [])
                  if kind != "messages" or m["ruleId"] == "prh"]
        if kind == "page":
            if median > MEDIAN:
                faults.append("half of the sentences have more than %g words" % MEDIAN)
            faults += ["the first screen lacks " + what for what in first_screen(path)]
        if kind != "messages":
            faults += ["%d words: %s" % (n, s) for n, s in zip(lengths, said) if n > LONGEST]
            faults += ["misspelt? " + w for w in sorted(unknown & spelt[path])]
        print("%s prose %s (median %g, longest %d)" % ("FAIL" if faults else "ok", name, median, longest))
        for fault in faults:
            print("    " + fault)
        failed |= bool(faults)
    sys.exit(failed)


if __name__ == "__main__":
    main()
