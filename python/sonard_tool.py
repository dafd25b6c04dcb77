# SPDX-License-Identifier: MIT
"""What the tools beside sonard have in common."""
import argparse
import difflib
import os
import re
import signal
import sys
import threading


class Parser(argparse.ArgumentParser):
    """Mistakes in options are told in one line, as the programs in C tell them."""

    def error(self, message):
        self.exit(2, "%s: %s%s\n" % (self.prog, message, "" if message.endswith("?") else "; see `%s --help`" % self.prog))

    def parse_args(self, args=None, namespace=None):
        known = self._option_string_actions  # pylint: disable=protected-access
        for arg in sys.argv[1:] if args is None else args:
            if arg == "--":
                break
            name = arg.partition("=")[0]
            if not re.match(r"-[^\d.]", arg) or arg[:2] in known or any(option.startswith(name) for option in known):
                continue
            meant = difflib.get_close_matches(name, [option for option in known if option.startswith("--")], 1, 0.75)
            self.error("no option %s%s" % (name, "; did you mean %s?" % meant[0] if meant else ""))
        return super().parse_args(args, namespace)


def reason(fault):
    """Why a file cannot be made, and what to do."""
    return fault.strerror + ("; remove it first, or name another" if isinstance(fault, FileExistsError) else "")


def end_on_signals():
    """SIGTERM and SIGHUP end the program as an interrupt does: unfinished files are removed."""
    if threading.current_thread() is not threading.main_thread():
        return  # of another program
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, lambda which, frame: sys.exit(128 + which))


def version_option(parser):
    """--version: that of the tree, or what was installed beside this file."""
    here = os.path.dirname(os.path.realpath(__file__))
    path = next(p for p in (os.path.join(here, "VERSION"), os.path.join(here, "..", "VERSION")) if os.path.exists(p))
    with open(path, encoding="ascii") as f:
        parser.add_argument("--version", action="version", version="%(prog)s " + f.read().strip())
