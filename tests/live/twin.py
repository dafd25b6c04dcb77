# SPDX-License-Identifier: MIT
"""twin - a virtual sonar that was made with tests/sim/lib/twin, on a bench's port."""
import os
import subprocess

from lib import BUILD, Process, check


class Twin(Process):
    def __init__(self, bench, program, *arguments):
        full = [os.path.join(BUILD, "tests", program), "--link", bench.port_path] + list(arguments)
        super().__init__(bench, program, full, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.lines = self.process.stdout
        check(self.lines.readline().startswith(b"ready "), "the virtual sonar does not start: " + self.log())
        bench.processes.append(self)

    def command(self, text):
        self.process.stdin.write(text.encode() + b"\n")
        self.process.stdin.flush()
        answer = self.lines.readline().decode().strip()
        check(answer.startswith("ok"), "%s: %s" % (text, answer))
        return answer

    def stop(self):
        status = super().stop()
        self.process.stdin.close()
        self.lines.close()
        return status


def micron(bench, *arguments, scene="box", centring_s=1):
    """A virtual Micron with a quick motor."""
    return Twin(bench, "micron_sim", "--scene", scene, "--truth", bench.path("truth"), "--centring", "%g" % centring_s,
                "--ms-per-gradian", "1", "--processing-ms", "1", *arguments)
