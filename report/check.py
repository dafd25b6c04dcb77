#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check.py - the report is made from nothing, in its quick form: well-formed, complete, self-contained, finite."""
import csv
import glob
import math
import os
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

HERE = os.path.dirname(os.path.abspath(__file__))
failed = 0


def check(name, faults):
    global failed
    for fault in faults[:10]:
        print(fault)
    print(("FAIL " if faults else "ok ") + "report_" + name)
    failed += bool(faults)


def not_finite(path):
    with open(path, newline="", encoding="utf-8") as f:
        rows = list(csv.reader(f))
    faults = [] if len(rows) > 1 else [f"{path}: no rows"]
    for i, row in enumerate(rows, 1):
        if len(row) != len(rows[0]):
            faults.append(f"{path}:{i}: {len(row)} fields, want {len(rows[0])}")
        for field in row:
            try:
                if not math.isfinite(float(field)):
                    faults.append(f"{path}:{i}: {field}")
            except ValueError:
                pass
    return faults


def local(tag):
    return tag.rpartition("}")[2]


def main():
    for program in ("gnuplot", "cmark-gfm"):
        if subprocess.run(["which", program], capture_output=True, check=False).returncode:
            print(f"skip report: no {program}")
            return
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "report")
        run = subprocess.run([os.path.join(HERE, "report.py"), "--quick", "--out", out, "--build",
                              os.environ.get("BUILD", "build")], capture_output=True, text=True, check=False)
        check("is_made_without_a_word_of_complaint", [run.stdout + run.stderr] if run.returncode or run.stderr else [])
        if run.returncode:
            return
        with open(os.path.join(out, "report.md"), encoding="utf-8") as f:
            text = f.read()
        pictures = re.findall(r"\]\((\w+\.svg)\)", text)
        drawn = sorted(os.path.basename(p) for p in glob.glob(out + "/*.svg") if os.path.getsize(p) > 1000)
        check("shows_every_plot_once", [] if pictures and sorted(pictures) == drawn else [f"{pictures} against {drawn}"])
        check("leaves_no_directive", re.findall(r"^@.*", text, re.M))
        try:
            page = list(xml.parse(os.path.join(out, "index.html")).iter())
        except xml.ParseError as fault:
            check("page_is_well_formed", [str(fault)])
            return
        check("page_is_well_formed", [])
        plots = sum(local(e.tag) == "figure" and any(local(c.tag) == "svg" for c in e) for e in page)
        check("page_holds_every_plot", [] if plots == len(pictures) else [f"{plots} of {len(pictures)}"])
        ids = [e.get("id") for e in page if e.get("id")]
        check("page_names_nothing_twice", [i for i in set(ids) if ids.count(i) > 1])
        links = [v for e in page for k, v in e.attrib.items() if local(k) in ("href", "src")]
        check("page_needs_nothing_else", [v for v in links if not v.startswith("#") or v[1:] not in ids])
        with open(os.path.join(out, "data", "stability.csv"), newline="", encoding="utf-8") as f:
            check("shows_every_case_of_the_catalogue", [row["case"] for row in csv.DictReader(f) if "| %s | %s |" % (row["case"], row["input"]) not in text])
        proofs = []
        for name in ("left_out_proof.csv", "spared_proof.csv", "saturated_proof.csv"):
            with open(os.path.join(out, "data", name), newline="", encoding="utf-8") as f:
                proofs += [row for row in csv.DictReader(f) if row["must_be"] == "same"]
        check("what_is_left_out_changes_nothing", [str(row) for row in proofs if row["changed"] != "0"] if proofs else
              ["no proofs"])
        with open(os.path.join(out, "data", "plan_proof.csv"), newline="", encoding="utf-8") as f:
            proofs = [row for row in csv.DictReader(f) if row["must_be"] == "same"]
        check("the_plan_changes_nothing", [str(row) for row in proofs if row["changed"] != "0"] if proofs else ["no proofs"])
        with open(os.path.join(out, "data", "voxel_false.csv"), newline="", encoding="utf-8") as f:
            rows = list(csv.DictReader(f))
        true = [r for r in rows if r["ranges"] == "true" and r["tolerance_voxels"] == "0" and r["world"] != "diver"]
        check("true_ranges_free_nothing_solid", [str(r) for r in true if r["false_free_m3"] != "0"] if true else
              ["no rows"])
        check("numbers_are_finite", [fault for path in glob.glob(out + "/data/*.csv") for fault in not_finite(path)])


main()
sys.exit(failed > 0)
