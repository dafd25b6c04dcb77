#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""libsonard and the Python module as `make install` leaves them: what they show, their examples against a living daemon, and what
they do when it dies."""
import ast
import asyncio
import filecmp
import os
import re
import select
import shlex
import shutil
import socket
import subprocess
import sys
import time

from lib import BUILD, PATIENCE, SANITIZER, SCHEMAS, Failed, Skipped, check, note, run, until

TOP = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))
MOVING = {"vehicle": {"unknown": "slow", "slow": "0.3 m/s"}, "pose": {"max_age": "60 s"}}
FLY = re.compile(r"fly (-?\d+\.\d+) (-?\d+\.\d+) (-?\d+\.\d+): (.*)")


def installed(bench):
    """`make install` below the bench's folder, of what was built: others run that meanwhile; its usr."""
    made = subprocess.run(["make", "-s", "BUILD=" + BUILD, "DESTDIR=" + bench.path("root"), "PREFIX=/usr", "install-built"],
                          cwd=TOP, env=dict(os.environ, MAKEFLAGS=""), capture_output=True, text=True, check=False)
    check(made.returncode == 0, "make install-built: " + made.stdout + made.stderr)
    return bench.path("root/usr")


def output(*arguments, **more):
    done = subprocess.run(arguments, capture_output=True, text=True, check=False, **more)
    check(done.returncode == 0, "%s: %s" % (" ".join(arguments), done.stdout + done.stderr))
    return done.stdout


def shows(bench):
    """The library shows what the header declares and the map names, no more; its soname is that of the map."""
    usr = installed(bench)
    library = usr + "/lib/libsonard.so.0"
    shown = {line.split()[-1] for line in output("nm", "-D", "--defined-only", library).splitlines()} - {"SONARD_0"}
    with open(usr + "/include/sonard.h", encoding="ascii") as f:
        header = f.read()
    declared = set(re.findall(r"\b(sonard_[a-z_]+)\(", re.sub(r"/\*.*?\*/", "", header, flags=re.S)))
    check({name.replace("@@SONARD_0", "") for name in shown} == declared, "shows %s, declares %s" % (shown, declared))
    check(all("@@" in name for name in shown), "without a version: %s" % shown)
    check("[libsonard.so.0]" in output("readelf", "-d", library), "soname")
    check(os.readlink(usr + "/lib/libsonard.so") == "libsonard.so.0", "the link for -lsonard")
    with open(TOP + "/docs/libsonard.3", encoding="ascii") as f:
        manual = f.read()
    check(not [name for name in declared if name not in manual], "not in the manual")


def compiled(bench, usr):
    """The example, compiled against the installed tree as its head says."""
    if SANITIZER:
        raise Skipped("a library with a sanitizer needs a program with it")
    pkg_config = dict(os.environ, PKG_CONFIG_SYSROOT_DIR=bench.path("root"), PKG_CONFIG_PATH=usr + "/lib/pkgconfig")
    flags = output("pkg-config", "--cflags", "--libs", "libsonard", env=pkg_config).split()
    program = bench.path("autopilot")
    output(*shlex.split(os.environ.get("CC", "cc")), "-std=c17", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Wextra", "-Wconversion", "-Wshadow",
           "-Werror", "-o", program, usr + "/share/doc/sonard/examples/autopilot.c", *flags)
    return program


def alone(bench):
    """The header needs nothing before it, jansson's least of all, also in C++."""
    usr = installed(bench)
    for compiler, standard in (("cc", "-std=c99"), ("c++", "-std=c++17")):
        if not shutil.which(compiler):
            note("%s is not installed" % compiler)
            continue
        source = bench.write("alone" + (".c" if compiler == "cc" else ".cc"), "#include <sonard.h>\nint main(void) { return 0; }\n")
        output(compiler, standard, "-pedantic", "-Wall", "-Wextra", "-Werror", "-I", usr + "/include", "-fsyntax-only", source)
        seen = output(compiler, "-I", usr + "/include", "-E", source)
        check("jansson" not in seen, "jansson in the interface")


def flown(process):
    """The next line of an autopilot: velocity and why."""
    ready = select.select([process.stdout], [], [], 20 * PATIENCE)[0]
    check(ready, "the autopilot says nothing")
    line = process.stdout.readline()
    match = FLY.match(line)
    check(match, "the autopilot says '%s'" % line)
    return float(match.group(1)), match.group(4)


def fly(bench, *command, env=None):
    """An autopilot flies while the daemon lives, stands still at once when it dies, and flies again after it came back."""
    bench.sim()
    bench.conf(**MOVING)
    daemon = bench.sonard()
    daemon.client().close()
    pilot = subprocess.Popen([*command, bench.socket_path], stdout=subprocess.PIPE, text=True, bufsize=1,
                             env=dict(os.environ, **(env or {})))
    try:
        speed, why = until(lambda: (lambda told: told[0] > 0 and told)(flown(pilot)), "the autopilot flies")
        check(0 < speed <= 1.0 and "ahead, limited by" in why, "%s: %s" % (speed, why))
        daemon.process.kill()
        daemon.expected = -9
        daemon.wait()
        until(lambda: flown(pilot)[0] == 0, "it stands still")
        for _ in range(3):
            speed, why = flown(pilot)
            check(speed == 0 and ("no daemon" in why or "ended the connection" in why), "%g without a daemon: %s" % (speed, why))
        bench.sonard()
        until(lambda: flown(pilot)[0] > 0, "it flies again")
    finally:
        pilot.terminate()
        pilot.wait()
        pilot.stdout.close()


def example_c(bench):
    usr = installed(bench)
    fly(bench, compiled(bench, usr), env={"LD_LIBRARY_PATH": usr + "/lib"})


def example_python(bench):
    usr = installed(bench)
    fly(bench, sys.executable, "-B", usr + "/share/doc/sonard/examples/autopilot.py",
        env={"PYTHONPATH": usr + "/lib/python3/dist-packages"})


def example_lines(bench):
    """The lines that stand at the head of the examples, as somebody copies them."""
    usr = installed(bench)
    for name in ("examples", "client", "python"):
        os.symlink(os.path.join(TOP, name), bench.path(name))
    os.symlink(os.path.abspath(os.path.join(TOP, BUILD)), bench.path("build"))
    shutil.copy(usr + "/share/doc/sonard/examples/autopilot.c", bench.path("autopilot.c"))
    env = dict(os.environ, PKG_CONFIG_SYSROOT_DIR=bench.path("root"), PKG_CONFIG_PATH=usr + "/lib/pkgconfig",
               LD_LIBRARY_PATH=usr + "/lib")
    env.pop("PYTHONPATH", None)
    folder = os.path.dirname(bench.path("autopilot.c"))
    with open(bench.path("autopilot.c"), encoding="ascii") as f:
        lines = re.findall(r"^ \*   (\S.*)$", f.read(), flags=re.M)
    check([line.split()[0] for line in lines] == ["cc", "./autopilot", "cc"], "%s" % lines)
    with open(os.path.join(TOP, "examples/autopilot.py"), encoding="ascii") as f:
        lines += re.findall(r"(PYTHONPATH=\S+ .*)", f.read())
    check(len(lines) == 4, "%s" % lines)
    for line in lines:
        if line.startswith("cc") and SANITIZER:
            continue
        line = re.sub(r"(\[SOCKET.*|SOCKET)$", "nowhere 1", line)
        if not line.startswith("./") or os.path.exists(bench.path("autopilot")):
            output("sh", "-c", line, cwd=folder, env=env)


def generated(bench):
    """What was written from the schema is what the schema has now."""
    os.mkdir(bench.path("new"))
    output(sys.executable, "-B", TOP + "/python/generate_methods", os.path.join(BUILD, "sonard-protocol.schema.json"), bench.path("new"),
           cwd=TOP)
    for name in ("results.py", "_methods.py"):
        check(filecmp.cmp(bench.path("new/" + name), TOP + "/python/sonard/" + name, shallow=False),
              "python/sonard/%s is of another schema: call python/generate_methods" % name)


def wheel(bench):
    """What pip makes of the tree, in an environment of its own: it holds the module with its types, and mypy has nothing to say."""
    python = "/usr/bin/python3"
    if not all(os.path.exists("/usr/lib/python3/dist-packages/" + name) for name in ("pip", "setuptools", "wheel")):
        raise Skipped("python3-pip, python3-setuptools or python3-wheel is not installed")
    tree, env = bench.path("tree"), dict(os.environ, PIP_DISABLE_PIP_VERSION_CHECK="1")
    shutil.copytree(TOP + "/python", tree + "/python", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "VERSION", "LICENSE"):
        shutil.copy(os.path.join(TOP, name), tree)
    output(python, "-m", "pip", "wheel", "-q", "--no-build-isolation", "--no-deps", "--no-index", "-w", bench.path("wheels"), tree, env=env)
    output(python, "-m", "venv", bench.path("venv"))
    inside = bench.path("venv/bin/python")
    output(inside, "-m", "pip", "install", "-q", "--no-index", *[bench.path("wheels/" + name) for name in os.listdir(bench.path("wheels"))],
           env=env)
    said = output(inside, "-c", "import os, sonard, sonard.aio; print(os.listdir(os.path.dirname(sonard.__file__)))", cwd="/")
    check(set(ast.literal_eval(said)) >= {"py.typed", "results.py", "aio.py"}, said)
    if not shutil.which("mypy"):
        note("mypy is not installed")
        return
    user = bench.write("user.py", "import sonard\n\n\ndef free(s: sonard.Client) -> float:\n"
                       "    found = s.nearest(distance_m=3, frame=\"ned\")\n    return found[\"range_m\"] or s.limit([1, 0, 0]).speed_mps\n")
    output("mypy", "--strict", "--python-executable", inside, "--cache-dir", bench.path("mypy"), TOP + "/python/sonard")
    output("mypy", "--strict", "--python-executable", inside, "--cache-dir", bench.path("mypy"), user, cwd=bench.path("wheels"))
    wrong = bench.write("wrong.py", "import sonard\n\nprint(sonard.connect().nearest(distance=3))\n")
    done = subprocess.run(["mypy", "--strict", "--python-executable", inside, "--cache-dir", bench.path("mypy"), wrong], cwd=bench.path("wheels"),
                          capture_output=True, text=True, check=False)
    check("distance" in done.stdout and done.returncode == 1, "mypy takes a wrong parameter: " + done.stdout + done.stderr)


def module():
    sys.path.insert(0, os.path.join(TOP, "python"))
    import sonard
    return sonard


def refuses(kind, ask):
    try:
        ask()
    except kind as fault:
        return fault
    raise Failed("no %s" % kind.__name__)


def python_answers(bench):
    """Every method, typed or not, gives what the schema has."""
    sonard = module()
    bench.sim()
    bench.conf(**MOVING)
    bench.sonard().client().close()
    with sonard.connect(bench.socket_path, timeout_s=20 * PATIENCE) as s:
        s.pose(attitude_deg=[0, 0, 0], depth_m=2, velocity_mps=[0.1, 0, 0])
        until(lambda: s.blocked(0, distance_m=30, half_angle_deg=5).state == "blocked", "the wall ahead")
        ahead = s.blocked(0, distance_m=30, half_angle_deg=5)
        check(ahead.range_m > 0 and 0 <= ahead.confidence <= 1 and ahead.reason, "%s" % ahead)
        ring = s.sectors(count=36)
        check(len(ring) == 36 and ring[9].azimuth_deg == 90 and {x.state for x in ring} <= {"blocked", "clear", "unknown"}, "%s" % ring)
        limit = s.limit((3, 0, 0))
        check(limit.limited_by in ("blocked", "unknown") and limit.speed_mps < 3, "%s" % limit)
        check(s.time_to_collision(velocity_mps=[1, 0, 0], ahead_s=30).state in ("blocked", "unknown"), "a meeting")
        for name in ("nearest", "status", "sensors", "stats", "version", "grid_list", "clusters"):
            SCHEMAS.check(name, "result", getattr(s, name)())
        check(refuses(sonard.Refused, lambda: s.blocked(0, distance_m=-1)).code == -32602, "a wrong parameter")
        check(refuses(sonard.Refused, lambda: s.call("nothing_like_that")).code == -32601, "an unknown method")
        refuses(ValueError, lambda: s.blocked(float("nan"), distance_m=1))
        check(s.version()["version"], "it goes on after refusals")


def python_watches(bench):
    """Two watches and questions between them: each gets its own, in order."""
    sonard = module()
    bench.sim()
    bench.conf(**MOVING)
    daemon = bench.sonard()
    daemon.client().close()
    s = sonard.connect(bench.socket_path, timeout_s=20 * PATIENCE)
    with s.watch("sectors", rate_hz=20, count=4) as four, s.watch("sectors", rate_hz=20, count=8) as eight:
        for _ in range(5):
            check(len(next(four)) == 4 and len(next(eight)) == 8, "mixed up")
            check(len(s.sectors(count=12)) == 12, "a question between")
        for i, ring in enumerate(four):
            check(len(ring) == 4 and isinstance(ring[0], sonard.Sector), "as an iterator")
            if i == 3:
                break
        check(select.select([s], [], [], 5 * PATIENCE)[0], "its descriptor can be waited for")
        until(lambda: s.version() and (s._kept[four.number] or {}).get("skipped"), "answers that nobody reads")
        check(len(next(four)) == 4 and four.skipped > 0 and s._kept[four.number] is None, "an old answer is given for a new one")
    check(s.status()["server"]["clients_now"] == 1, "the client is still there")
    refuses(StopIteration, lambda: next(four))
    for kind, method, params in ((sonard.Blocked, "blocked", {"azimuth_deg": 0, "distance_m": 1}),
                                 (sonard.Limit, "limit", {"velocity_mps": [1, 0, 0]}),
                                 (sonard.Collision, "time_to_collision", {"velocity_mps": [1, 0, 0]}),
                                 (dict, "nearest", {})):
        with s.watch(method, rate_hz=20, **params) as watch:
            check(type(next(watch)) is kind, "%s is watched as another type than it is asked" % method)
    slow = s.watch("sectors", rate_hz=0.1)
    slow.next()
    began = time.monotonic()
    refuses(sonard.Silent, lambda: slow.next(timeout_s=0.05))
    check(time.monotonic() - began < 5 * PATIENCE, "the time-out is that of the call")
    failing = s.watch("point", rate_hz=10, position_m=[0, 0, 0])
    check(refuses(sonard.Refused, failing.next).code == -32600, "no map")
    daemon.stop()
    refuses(sonard.Lost, lambda: s.call("version"))
    s.close()


def python_asyncio(bench):
    """Many questions at a time and a watch beside them; a daemon that dies ends them all."""
    module()
    from sonard import Lost, NoDaemon, Refused, aio
    import sonard
    bench.sim()
    bench.conf(**MOVING)
    daemon = bench.sonard()
    daemon.client().close()

    async def fly():
        async with await aio.connect(bench.socket_path, timeout_s=20 * PATIENCE) as s:
            await s.pose(attitude_deg=(0, 0, 0), depth_m=2)
            said = await asyncio.gather(*[s.sectors(count=n) for n in range(1, 9)], s.nearest(), s.blocked(0, 5), s.limit([1, 0, 0]))
            check([len(ring) for ring in said[:8]] == list(range(1, 9)), "%s" % said[:8])
            SCHEMAS.check("nearest", "result", said[8])
            check(isinstance(said[9], sonard.Blocked) and isinstance(said[10], sonard.Limit), "%s" % said[9:])
            try:
                await s.blocked(0, distance_m=-1)
                raise Failed("a wrong parameter was taken")
            except Refused as fault:
                check(fault.code == -32602, "%s" % fault)
            four, eight = await s.watch("sectors", rate_hz=20, count=4), await s.watch("sectors", rate_hz=20, count=8)
            for _ in range(5):
                check(len(await four.__anext__()) == 4 and len(await eight.__anext__()) == 8, "mixed up")
            for _ in range(int(200 * PATIENCE)):
                if four._queue.qsize() and four._queue._queue[0].get("skipped"):
                    break
                await asyncio.sleep(0.05)
            check(len(await four.__anext__()) == 4 and four.skipped > 0 and four._queue.empty(), "an old answer is given for a new one")
            waits = asyncio.ensure_future(eight.__anext__())
            await four.stop()
            check([ring async for ring in four] == [], "a watch that was stopped goes on")
            await waits
            daemon.process.kill()
            daemon.expected = -9
            try:
                async for _ in eight:
                    pass
                raise Failed("a watch ends without a word")
            except Lost:
                pass
            try:
                await s.version()
                raise Failed("an answer of a daemon that is gone")
            except Lost:
                pass
        daemon.wait()
        try:
            await aio.connect(bench.socket_path, timeout_s=20 * PATIENCE)
            raise Failed("connected to nobody")
        except NoDaemon:
            pass

    asyncio.run(fly())


def python_errors(bench):
    """Nobody there, no answer, nonsense, half a line: an exception of its own kind each, none waits longer than it may."""
    sonard = module()
    check("is sonard running" in str(refuses(sonard.NoDaemon, lambda: sonard.connect(bench.socket_path, 0.2))), "no daemon")
    full = socket.socket(socket.AF_UNIX)  # takes one client into its queue and no more
    full.bind(bench.socket_path)
    full.listen(0)
    first = sonard.connect(bench.socket_path, 0.2)
    check("does not take new clients" in str(refuses(sonard.Silent, lambda: sonard.connect(bench.socket_path, 0.2))), "a full queue")
    first.close()
    full.close()
    os.unlink(bench.socket_path)
    refuses(sonard.NoDaemon, lambda: sonard.connect("/" + "x" * 200, 0.2))
    check("/dev/null is not a socket" == str(refuses(sonard.NoDaemon, lambda: sonard.connect("/dev/null", 0.2))), "a device")
    for said, kind in ((b"", sonard.Silent), (b"SSH-2.0\n", sonard.Lost), (b"[]\n", sonard.Lost), (b'{"id":1}\n', sonard.Lost),
                       (b'{"id":1,"result"', sonard.Silent), (b'{"id":null,"error":{"code":-32000,"message":"full"}}\n', sonard.Refused),
                       (b'{"id":7,"result":1}\n', sonard.Silent), (b'{"id":1,"error":7}\n', sonard.Lost), (b'{"id":1,"result":{"state":"clear"}}\n', sonard.Lost)):
        peer = subprocess.Popen([sys.executable, "-c", "import socket,sys,time\nl=socket.socket(socket.AF_UNIX);l.bind(sys.argv[1]);"
                                 "l.listen(1)\nprint(flush=True)\nc,_=l.accept();c.recv(9999);c.sendall(eval(sys.argv[2]))\n"
                                 "while c.recv(9999): pass", bench.socket_path, repr(said)], stdout=subprocess.PIPE)
        peer.stdout.readline()
        try:
            with sonard.connect(bench.socket_path, 0.3 * PATIENCE) as s:
                fault = refuses(sonard.Error, lambda: s.blocked(0, distance_m=1))
                check(type(fault) is kind, "%s gives %r" % (said, fault))
        finally:
            peer.terminate()
            peer.wait()
            peer.stdout.close()
            os.unlink(bench.socket_path)


def python_asyncio_errors(bench):
    """Nonsense ends the connection for all who wait, at once: nothing but silence is waited for."""
    sonard = module()
    from sonard import aio

    async def ask(said):
        async def serve(reader, writer):
            await reader.readline()
            writer.write(said)
            writer.close()
        server = await asyncio.start_unix_server(serve, bench.socket_path)
        async with await aio.connect(bench.socket_path, 60 * PATIENCE) as s:
            for _ in range(2):
                try:
                    await s.blocked(0, distance_m=1)
                    raise Failed("%s is an answer" % said)
                except sonard.Lost:
                    pass
        server.close()
        os.unlink(bench.socket_path)

    full = socket.socket(socket.AF_UNIX)  # takes one client into its queue and no more
    full.bind(bench.socket_path)
    full.listen(0)

    async def queue():
        async with await aio.connect(bench.socket_path, 0.2):
            try:
                await aio.connect(bench.socket_path, 0.2)
                raise Failed("connected to a daemon that takes nobody")
            except sonard.Silent:
                pass

    asyncio.run(queue())
    full.close()
    os.unlink(bench.socket_path)
    for said in (b"SSH-2.0\n", b"[]\n", b"{}\n", b'{"method":"watch","params":{}}\n', b'{"params":{"watch":[]}}\n', b"[" * 100000 + b"\n"):
        asyncio.run(ask(said))


run([("library_" + f.__name__, f) for f in (shows, alone, generated, example_lines, example_c, example_python, wheel, python_answers, python_watches, python_asyncio, python_asyncio_errors,
                                             python_errors)],
    gate=("library_shows", "library_alone", "library_generated"))
