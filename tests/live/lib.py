# SPDX-License-Identifier: MIT
"""lib - what the tests of the live daemon share: a virtual sonar, a sonard and its clients, in a folder of their
own.

Every process started here is ended here, by its own handle; the logs of a case that failed are printed. Limits are
generous, grow under sanitizers and by the variable PATIENCE: they end a test that hangs, they measure nothing.
"""
import argparse
import concurrent.futures
import json
import os
import re
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import traceback

BUILD = os.path.abspath(os.environ.get("BUILD", "build"))
SONARD = os.path.join(BUILD, "sonard")
SONARCTL = os.path.join(BUILD, "sonarctl")
SIM = os.path.join(BUILD, "tests", "ping360_sim")
os.environ["PATH"] = os.path.abspath("python") + ":" + os.environ["PATH"]  # sonarctl runs a tool of this tree


def _sanitizer():
    with open(SONARD, "rb") as f:
        program = f.read()
    return "thread" if b"__tsan_init" in program else "address" if b"__asan_init" in program else None


SANITIZER = _sanitizer()
PATIENCE = float(os.environ.get("PATIENCE") or 1) * (10 if SANITIZER else 1)
SEED = int(os.environ.get("SONARD_SEED") or 20260101)  # of whatever is drawn at random
ALL = "all cases"  # of a file, for the gate


class Failed(Exception):
    pass


class Skipped(Exception):
    pass


def helper(name):
    """The path of what `make tests` builds for the tests."""
    path = os.path.join(BUILD, "tests", name)
    check(os.path.exists(path), "%s is not there: make programs tests" % path)
    return path


def check(condition, why):
    if not condition:
        raise Failed(why)


_printing = threading.Lock()


def note(text):
    with _printing:
        print("# " + text, flush=True)


def until(condition, what, limit_s=20.0, every_s=0.02):
    """Polls until condition() is true and returns what it gave; fails after limit_s (longer under sanitizers)."""
    end = time.monotonic() + limit_s * PATIENCE
    while True:
        value = condition()
        if value:
            return value
        check(time.monotonic() < end, "waited %g s in vain: %s" % (limit_s * PATIENCE, what))
        time.sleep(every_s)


try:
    import jsonschema
except ImportError:
    sys.exit("FAIL imports: python3-jsonschema is not installed (make deps)")

SCHEMA = os.path.join(BUILD, "sonard-protocol.schema.json")


# A good value for every parameter that some method cannot be called without.
STANDARD = {"azimuth_deg": 0, "distance_m": 1, "velocity_mps": [1, 0, 0], "position_m": [0, 0, 0], "from_m": [0, 0, 0],
            "to_m": [1, 1, 1], "points_m": [[0, 0, 0]], "radius_m": 1, "name": "a", "method": "version", "watch": 1,
            "id": 1}


_held_ports = []


def free_port():
    """A port of 127.0.0.1 that is free for UDP and TCP, and stays so until a program of this test binds it. It lies below those
    that the kernel hands out by itself; a name in the abstract namespace keeps other tests off it while this one runs."""
    for port in range(20000, 32000):
        mine = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            mine.bind("\0sonard-test-port-%d" % port)
            for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
                with socket.socket(socket.AF_INET, kind) as probe:
                    probe.bind(("127.0.0.1", port))
        except OSError:
            mine.close()
            continue
        _held_ports.append(mine)
        return port
    raise Failed("no port from 20000 to 31999 is free")


class Schema:
    """What `sonard --schema` prints. Holding against it takes longer than the daemon takes to answer: of what is
    asked again and again every tenth is."""

    def __init__(self):
        with open(SCHEMA, encoding="ascii") as f:
            self.document = json.load(f)
        self.validators = {}
        self.held = {}

    def methods(self):
        return sorted(name[:-len(".params")] for name in self.document["$defs"] if name.endswith(".params"))

    def needed(self, method):
        """Parameters with which a method can be called."""
        return {key: STANDARD[key] for key in self.document["$defs"][method + ".params"].get("required", [])}

    def faults(self, name, value):
        """What is wrong with a value by $defs/NAME."""
        if name not in self.validators:
            definitions = {"$ref": "#/$defs/" + name, "$defs": self.document["$defs"]}
            self.validators[name] = jsonschema.Draft202012Validator(definitions)
        return ["%s: %s at %s" % (name, e.message[:300], list(e.path))
                for e in self.validators[name].iter_errors(value)]

    def check(self, method, part, value):
        name = "%s.%s" % (method, part)
        self.held[name] = self.held.get(name, 0) + 1
        if self.held[name] <= 100 or self.held[name] % 10 == 0:
            faults = self.faults(name, value)
            check(not faults, "not as the schema has it: " + "; ".join(faults[:3]))


SCHEMAS = Schema()


class RpcError(Exception):
    def __init__(self, error):
        super().__init__(error["message"])
        self.code = error["code"]


class Client:
    """A JSON-RPC client. Notifications that come between the replies are kept in .notifications."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(path)
        self.held = b""
        self.last_id = 0
        self.notifications = []

    def close(self):
        self.socket.close()

    def leave(self):
        """Ends, and waits until the daemon has done so as well: then nothing of this client is left in it."""
        self.socket.shutdown(socket.SHUT_WR)
        while self.line() is not None:
            pass
        self.close()

    def send(self, data):
        self.socket.sendall(data)

    def line(self, limit_s=20.0):
        """The next line without its newline; None when the daemon has closed the connection."""
        end = time.monotonic() + limit_s * PATIENCE
        while b"\n" not in self.held:
            ready = select.select([self.socket], [], [], max(0, end - time.monotonic()))[0]
            check(ready, "no line from the daemon")
            try:
                data = self.socket.recv(65536)
            except ConnectionResetError:
                data = b""
            if not data:
                return None
            self.held += data
        line, self.held = self.held.split(b"\n", 1)
        return line

    def reply(self):
        """The next line that is no notification, as JSON; None at the end of the connection."""
        while True:
            line = self.line()
            message = json.loads(line) if line is not None else None
            if isinstance(message, dict) and "method" in message:
                if "result" in message["params"]:
                    SCHEMAS.check(message["params"]["method"], "result", message["params"]["result"])
                self.notifications.append(message["params"])
            else:
                return message

    def call(self, method, /, **params):
        self.last_id += 1
        request = {"jsonrpc": "2.0", "id": self.last_id, "method": method, "params": params}
        self.send(json.dumps(request).encode() + b"\n")
        reply = self.reply()
        check(reply is not None, "the daemon closed the connection during '%s'" % method)
        check(reply["id"] == self.last_id, "'%s' was answered by %s" % (method, reply))
        if "error" in reply:
            raise RpcError(reply["error"])
        SCHEMAS.check(method, "params", params)
        SCHEMAS.check(method, "result", reply["result"])
        return reply["result"]

    def sensor(self):
        return self.call("status")["sensors"][0]


class Process:
    """A program that writes its log into the bench's folder. status is None while it runs."""

    def __init__(self, bench, name, arguments, env=None, **pipes):
        self.name = name
        self.log_path = bench.path(name + ".log")
        self.expected = 0
        pipes.setdefault("stdin", subprocess.DEVNULL)
        pipes.setdefault("stdout", subprocess.DEVNULL)
        with open(self.log_path, "ab") as log:
            self.process = subprocess.Popen(arguments, stderr=log, env=dict(os.environ, **(env or {})), **pipes)
        self.pid = self.process.pid

    def log(self):
        with open(self.log_path, encoding="utf-8", errors="replace") as f:
            return f.read()

    @property
    def status(self):
        return self.process.poll()

    def wait(self, limit_s=20.0):
        try:
            return self.process.wait(limit_s * PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise Failed("%s did not end" % self.name) from None

    def stop(self):
        """SIGTERM and the exit status."""
        if self.status is None:
            self.process.send_signal(signal.SIGTERM)
        return self.wait()


class Sim(Process):
    def __init__(self, bench, name, arguments, program=SIM):
        super().__init__(bench, name, [program] + arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.lines = self.process.stdout
        self.turn = threading.Lock()  # of threads that command it: one would take the answer to another's command
        ready = self.lines.readline().decode()
        check(ready.startswith("ready "), "the virtual sonar does not start: " + self.log())
        self.address = ready.split()[1]

    def command(self, text):
        """Does a command on the sonar's standard input; returns what follows its "ok"."""
        with self.turn:
            self.process.stdin.write(text.encode() + b"\n")
            self.process.stdin.flush()
            answer = self.lines.readline().decode().strip()
        check(answer.startswith("ok"), "%s: %s" % (text, answer))
        return answer[3:]

    def pings(self):
        return int(re.search(r"(\d+) pings,", self.command("status")).group(1))

    def stop(self):
        status = super().stop()
        self.process.stdin.close()
        self.lines.close()
        return status


class Daemon(Process):
    def __init__(self, bench, name, arguments, env, **pipes):
        self.socket_path = bench.socket_path
        super().__init__(bench, name, [SONARD] + arguments, env, **pipes)

    def client(self):
        """Connects as soon as the socket is there."""
        def connect():
            check(self.status is None, "sonard ended with %s: %s" % (self.status, self.log()))
            try:
                return Client(self.socket_path)
            except (FileNotFoundError, ConnectionRefusedError):
                return None
        return until(connect, "sonard's socket")


DEFAULTS = {
    "sonar head": {"device": "ping360", "range": "10 m"},
    "extract": {"no_echo": "heard"},
    "log": {"level": "debug"},
}
PING360 = {"step": "1.8 deg", "mode": "transmit"}  # the head's, while it is one


class Bench:
    """A folder with the virtual sonar's line, the configuration, the socket and the logs of one case."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="sonard-live-")
        self.socket_path = self.path("sonard.sock")
        self.port_path = self.path("port")
        self.processes = []

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, content):
        with open(self.path(name), "wb") as f:
            f.write(content if isinstance(content, bytes) else content.encode())
        return self.path(name)

    def conf(self, baud=4000000, name="sonard.conf", **sections):
        """Writes the configuration: the defaults above, changed by section={key: value}; returns its path."""
        merged = {section: dict(keys) for section, keys in DEFAULTS.items()}
        merged["sonar head"]["port"] = "serial:%s:%d" % (self.port_path, baud)
        merged["server"] = {"socket": self.socket_path}
        for section, keys in sections.items():
            merged.setdefault("sonar head" if section == "sonar" else section, {}).update(keys)
        if merged["sonar head"]["device"] == "ping360":
            merged["sonar head"] = dict(PING360, **merged["sonar head"])
        text = "".join("[%s]\n%s\n" % (section, "".join("%s = %s\n" % item for item in keys.items()))
                       for section, keys in merged.items())
        return self.write(name, text)

    def sim(self, *arguments, scene="box", truth=False, quick=True):
        """A virtual sonar on the port; quick: with a motor and a processor faster than the real head's."""
        full = ["--link", self.port_path, "--scene", scene] + list(arguments)
        if quick:
            full += ["--ms-per-gradian", "1", "--processing-ms", "2"]
        if truth:
            full += ["--truth", self.path("truth")]
        return self._keep(Sim(self, "sim%d" % len(self.processes), full))

    def twin(self, program, *arguments):
        """Another virtual sonar of tests/sim; its .address is the path of its terminal, or HOST:PORT."""
        path = os.path.join(BUILD, "tests", program)
        return self._keep(Sim(self, "%s%d" % (program, len(self.processes)), list(arguments), path))

    def sonard(self, *arguments, conf=None, env=None, **pipes):
        """sonard with the configuration of conf(), or with no -c at all when conf is False."""
        full = list(arguments)
        if conf is not False:
            full += ["-c", conf or self.path("sonard.conf")]
        return self._keep(Daemon(self, "sonard%d" % len(self.processes), full, env, **pipes))

    def run(self, program, *arguments, limit_s=60):
        """Runs a program to its end; the result has returncode, stdout and stderr."""
        return subprocess.run([program] + list(arguments), capture_output=True, text=True, errors="replace",
                              timeout=limit_s * PATIENCE, stdin=subprocess.DEVNULL, check=False)

    def sonarctl(self, *arguments):
        return self.run(SONARCTL, "--socket", self.socket_path, *arguments)

    def truth(self):
        """What the virtual sonar wrote of its pings so far."""
        with open(self.path("truth"), encoding="ascii") as f:
            return [json.loads(line) for line in f.read().split("\n")[:-1]]

    def logs(self):
        for process in self.processes:
            lines = process.log().splitlines()
            yield "%s (status %s):" % (process.name, process.status)
            yield from ("    " + line for line in lines[-25:])

    def end(self):
        """Ends what still runs, daemons before sonars, and returns what was wrong with it."""
        faults = []
        for process in reversed(self.processes):
            try:
                status = process.stop()
            except Failed as fault:
                faults.append(str(fault))
                continue
            if status != process.expected:
                faults.append("%s ended with status %s, expected %s" % (process.name, status, process.expected))
            if "Sanitizer" in process.log() or "runtime error" in process.log():
                faults.append("%s: a sanitizer complains" % process.name)
        return faults

    def _keep(self, process):
        self.processes.append(process)
        return process


def pings_until(client, count, limit_s=30.0):
    """Waits until the sonar has done `count` more pings."""
    first = client.sensor()["pings"]
    until(lambda: client.sensor()["pings"] >= first + count, "%d pings" % count, limit_s, 0.05)


def jump(daemon, to_s, **more):
    """Jumps, and returns a client once the daemon is there: a jump back ends all connections."""
    daemon.client().call("replay", to_s=to_s, **more)

    def there():
        try:
            client = daemon.client()
            status = client.call("status")
        except (Failed, OSError):
            return None  # the connection was made before all of them ended
        state = status["replay"]
        arrived = not state["jumping"] and (state["position_s"] >= to_s - 1e-3 or status["mode"] == "replay, ended")
        return client if arrived and (not state["paused"] or state["position_s"] < to_s + 1e-3) else None
    return until(there, "a jump to %.3f s" % to_s)


def _run_case(name, function):
    bench = Bench()
    verdict = "ok " + name
    details = []
    try:
        function(bench)
    except Skipped as why:
        verdict = "skip %s: %s" % (name, why)
    except Failed as why:
        verdict = "FAIL %s: %s" % (name, why)
    except Exception as fault:  # a test that breaks is a test that fails
        verdict = "FAIL %s: %s: %s" % (name, type(fault).__name__, fault)
        details = traceback.format_exc().splitlines()
    faults = bench.end()
    if faults and verdict.startswith("ok"):
        verdict = "FAIL %s: %s" % (name, "; ".join(faults))
    if verdict.startswith("FAIL"):
        details += bench.logs()
    shutil.rmtree(bench.folder, ignore_errors=True)
    with _printing:
        for line in details:
            print("# " + line)
        print(verdict, flush=True)
    return not verdict.startswith("FAIL")


def refused(client, method, code=None, /, **params):
    """The sentence with which a call is refused, and with this code where one is given; fails when it is taken."""
    try:
        client.call(method, **params)
    except RpcError as error:
        check(code in (None, error.code), "%s: code %d, expected %s: %s" % (method, error.code, code, error))
        return str(error)
    raise Failed("%s %s was not refused" % (method, params))


def expect_refusal(client, method, params, why, code=None):
    """Such a call is refused in these words."""
    said = refused(client, method, code, **params)
    check(why in said, "%s: %s" % (method, said))


def run(cases, parallel=1, gate=()):
    """Runs (name, function(bench)) pairs, prints their verdicts and exits. `gate` names the cases whose verdict depends
    on no clock, no rate and no chance: --gate runs these alone. A word chooses cases whose name it is a part of."""
    options = argparse.ArgumentParser()
    options.add_argument("--gate", action="store_true")
    options.add_argument("part", nargs="?", default="")
    wanted = options.parse_args()
    names = [name for name, _ in cases]
    check(gate == ALL or set(gate) <= set(names), "no such case for the gate: %s" % sorted(set(gate) - set(names)))
    chosen = [(name, function) for name, function in cases
              if wanted.part in name and (not wanted.gate or gate == ALL or name in gate)]
    with concurrent.futures.ThreadPoolExecutor(parallel) as pool:
        good = list(pool.map(lambda case: _run_case(*case), chosen))
    sys.exit(0 if all(good) else 1)
