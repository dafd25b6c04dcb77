# SPDX-License-Identifier: MIT
"""What the tools beside sonard have in common."""
import os


def version_option(parser):
    """--version: that of the tree, or what was installed beside this file."""
    here = os.path.dirname(os.path.realpath(__file__))
    path = next(p for p in (os.path.join(here, "VERSION"), os.path.join(here, "..", "VERSION")) if os.path.exists(p))
    with open(path, encoding="ascii") as f:
        parser.add_argument("--version", action="version", version="%(prog)s " + f.read().strip())
