#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The BlueOS extension: its programs as start.sh starts them, here and from the image's root file system in a container:
the page, the ring of a virtual Ping360 over UDP, a pose over MAVLink. `make check-blueos` makes the image first."""
import glob
import json
import os
import platform
import shutil
import socket
import struct
import subprocess
import threading
import time

from lib import BUILD, Process, Skipped, check, free_port, note, run, until
from mavlink_frame import ATTITUDE, HEARTBEAT, frame
from webclient import Web

PACKAGED = "packaging/blueos"
CAPABILITIES = ["CAP_" + c for c in "CHOWN DAC_OVERRIDE FOWNER KILL SETGID SETUID SETPCAP NET_BIND_SERVICE".split()]  # as Docker has


class Extension(Process):
    """The extension with a bind of its own, asked over HTTP only."""
    raw, request, get = Web.raw, Web.request, Web.get

    def __init__(self, bench, port, command, env=None):
        self.port = port
        super().__init__(bench, "extension%d" % len(bench.processes), command, env)
        bench.processes.append(self)

    def answers(self, method, **params):
        """The result, or None while there is none."""
        try:
            status, result = self.get("/api/" + method, **params)
            return result if status == 200 else None
        except (ConnectionRefusedError, ConnectionResetError):
            check(self.status is None, "the extension ended: " + self.log())
            return None


def filled(bench, sim):
    """A bind as a user has edited it: (folder, port of the page, port of MAVLink)."""
    data = bench.path("data")
    os.makedirs(data)
    page, mavlink = free_port(), free_port()
    with open(PACKAGED + "/sonard.conf", encoding="ascii") as f:
        conf = f.read()
    check("udp:127.0.0.1:9092" in conf, "the packaged configuration has another port")
    conf = conf.replace("udp:127.0.0.1:9092", "udp:" + sim.address).replace("near = 4.6 m", "near = 0.8 m\nstation_keeping = 0 m/s")
    bench.write("data/sonard.conf", conf)
    bench.write("data/extension.conf", 'SONARD_WEB="--listen any:%d --names blueos.local"\nSONARD_MAVLINK="--link udpin:%d"\n'
                'touch "$data/ran"\n' % (page, mavlink))  # the programs' user may write this file, and root reads it
    return data, page, mavlink


def sonar(bench):
    return bench.twin("ping360_sim", "--ms-per-gradian", "1", "--processing-ms", "2", "--udp", "0")


def here(bench, data, port):
    return Extension(bench, port, [PACKAGED + "/start.sh"], {"SONARD_DATA": data, "SONARD_SOCKET": bench.socket_path,
                                                             "PATH": BUILD + ":" + os.environ["PATH"]})


def autopilot(port, stop):
    """What an endpoint of BlueOS sends: heartbeats and an attitude with heading 90 degrees."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        for n in range(100000):
            if stop.wait(0.05):
                return
            t_ms = int(time.monotonic() * 1000) & 0xFFFFFFFF
            if n % 10 == 0:
                s.sendto(frame(HEARTBEAT, struct.pack("<IBBBBB", 0, 12, 3, 0, 4, 3), n), ("127.0.0.1", port))
            s.sendto(frame(ATTITUDE, struct.pack("<Iffffff", t_ms, 0, 0, 1.5708, 0, 0, 0), n + 1), ("127.0.0.1", port))


def works(extension, sim, mavlink):
    """The page, the ring with the walls of the box, how BlueOS finds it, and a heading over MAVLink."""
    until(lambda: extension.answers("status"), "the daemon's answer", 60)
    for path, start in (("/", b"<!DOCTYPE html>"), ("/app.js", b"//")):
        status, _, body = extension.request(path)
        check(status == 200 and body.startswith(start), "%s: %s" % (path, status))
    check(extension.request("/", host="blueos.local:%d" % extension.port)[0] == 200, "not by the name blueos.local")
    check(extension.request("/", host="evil.example")[0] == 403, "by any name")
    service = extension.get("/register_service")[1]
    check(service["name"] == "sonard" and service["icon"].startswith("mdi-") and service["version"], service)

    def ring():
        answer = extension.answers("sectors", distance_m=0)
        return answer and sum(s["state"] == "blocked" for s in answer["sectors"]) > 60 and answer
    at = {s["azimuth_deg"]: s for s in until(ring, "a ring around the virtual sonar", 60)["sectors"]}
    for azimuth, wall in ((0, 9), (90, 4), (180, 6), (270, 5)):
        check(at[azimuth]["state"] == "blocked" and abs(at[azimuth]["range_m"] - wall) < 0.5, "the wall at %s m: %s" % (wall, at[azimuth]))
    stop = threading.Event()
    sender = threading.Thread(target=autopilot, args=(mavlink, stop))
    sender.start()
    try:
        def heading():
            attitude = extension.answers("status")["pose"]["attitude_deg"]
            return attitude and abs(attitude[2] - 90) < 0.1
        until(heading, "the heading over MAVLink", 30)
    finally:
        stop.set()
        sender.join()
    note("%d pings of the virtual sonar" % sim.pings())


def children(pid):
    with open("/proc/%d/task/%d/children" % (pid, pid), encoding="ascii") as f:
        own = [int(p) for p in f.read().split()]
    return own + [g for p in own for g in children(p)]


def name_of(pid):
    try:
        with open("/proc/%d/comm" % pid, encoding="ascii") as f:
            return f.read().strip()
    except FileNotFoundError:
        return None


def starts(bench):
    """The three programs; one that is killed comes back; SIGTERM ends all of them."""
    sim = sonar(bench)
    data, port, mavlink = filled(bench, sim)
    extension = here(bench, data, port)
    works(extension, sim, mavlink)
    all_of = lambda: {name_of(p): p for p in children(extension.pid) if name_of(p) not in (None, "start.sh", "sh", "sleep")}
    check(set(all_of()) == {"sonard", "sonard-web", "sonard-mavlink"}, all_of())
    killed = all_of()["sonard"]
    os.kill(killed, 9)
    until(lambda: all_of().get("sonard") not in (None, killed), "another sonard")
    until(lambda: extension.answers("status"), "its answer")
    pids = children(extension.pid)
    extension.stop()
    check(not os.path.exists(data + "/ran"), "a line of extension.conf was run")
    check(not [p for p in pids if name_of(p) in ("sonard", "sonard-web", "sonard-mavlink")], "a program is left: %s" % [name_of(p) for p in pids])


def first_time(bench):
    """An empty bind is filled with what is packaged; what lies there is not written over. What is packaged has no faults."""
    data = bench.path("data")
    extension = here(bench, data, 0)
    until(lambda: os.path.exists(data + "/extension.conf"), "the files in the bind")
    extension.stop()
    for name in ("sonard.conf", "extension.conf"):
        with open(os.path.join(data, name), "rb") as a, open(os.path.join(PACKAGED, name), "rb") as b:
            check(a.read() == b.read(), name)
    checked = bench.run(os.path.join(BUILD, "sonard"), "--check", PACKAGED + "/sonard.conf")
    check(checked.returncode == 0, checked.stderr)
    bench.write("data/sonard.conf", "# mine\n")
    again = here(bench, data, 0)
    until(lambda: "sonard ended" in again.log(), "the fault of an empty configuration in the log")
    again.stop()
    with open(data + "/sonard.conf", encoding="ascii") as f:
        check(f.read() == "# mine\n", "the user's configuration is gone")


def archive(arch):
    found = glob.glob(os.path.join(BUILD, "blueos", "sonard-blueos-*-%s.tar" % arch))
    if not found:
        raise Skipped("`make blueos ARCHS=%s` makes the image first" % arch)
    if os.getuid() or not shutil.which("umoci") or not shutil.which("bwrap"):
        raise Skipped("needs root, umoci and bubblewrap")
    return max(found, key=os.path.getmtime)


def unpacked(bench, path):
    """(labels, root file system, what the container runs) of an archive."""
    layout, bundle = bench.path("layout"), bench.path("bundle")
    os.mkdir(layout)
    subprocess.run(["tar", "-xf", os.path.abspath(path), "-C", layout], check=True)
    with open(layout + "/manifest.json", encoding="ascii") as f:
        docker, = json.load(f)
    with open(os.path.join(layout, docker["Config"]), encoding="ascii") as f:
        labels = json.load(f)["config"]["Labels"]
    subprocess.run(["umoci", "unpack", "--image", "%s:%s" % (layout, labels["version"]), bundle], check=True, capture_output=True)
    with open(bundle + "/config.json", encoding="ascii") as f:
        return labels, bundle + "/rootfs", json.load(f)["process"]


def contained(root, data, process):
    """bubblewrap as Docker with the labels' permissions: the host's network, its own processes, the bind."""
    command = ["bwrap", "--die-with-parent", "--unshare-pid", "--unshare-ipc", "--bind", root, "/", "--bind", data, "/data",
               "--proc", "/proc", "--dev", "/dev", "--tmpfs", "/run", "--clearenv", "--chdir", process["cwd"]]
    for variable in process["env"]:
        command += ["--setenv"] + variable.split("=", 1)
    for capability in CAPABILITIES:
        command += ["--cap-add", capability]
    return command


def image(bench):
    """The archive is what Docker and OCI have, small, with the labels of an extension; its root file system works."""
    path = archive({"x86_64": "amd64", "aarch64": "arm64"}.get(platform.machine()))
    size = os.path.getsize(path)
    note("%s: %.1f MB" % (os.path.basename(path), size / 1e6))
    check(size < 60e6, "%d bytes" % size)
    labels, root, process = unpacked(bench, path)
    check(set(labels) == {"version", "permissions", "authors", "company", "readme", "links", "type", "tags", "requirements"}, set(labels))
    for name in ("permissions", "authors", "company", "links", "tags"):
        json.loads(labels[name])
    links = json.loads(labels["links"])
    check(all(word.startswith("https://") for word in (labels["readme"], links["website"], links["source"], links["support"])), "addresses of packaging/identity: %s" % links)
    check(json.loads(labels["permissions"])["HostConfig"]["Binds"] == ["/usr/blueos/extensions/sonard:/data"], labels["permissions"])
    sim = sonar(bench)
    data, port, mavlink = filled(bench, sim)
    extension = Extension(bench, port, contained(root, data, process) + process["args"])
    extension.expected = -15  # of bubblewrap itself
    works(extension, sim, mavlink)
    users = {name_of(p): os.stat("/proc/%d" % p).st_uid for p in children(extension.pid)}
    check(users["sonard"] == users["sonard-web"] == users["sonard-mavlink"] != 0, "as root: %s" % users)


def emulated(bench, arch, machine):
    """The image for another machine: its programs one by one under the emulator, which cannot start what its shell starts."""
    path = archive(arch)
    emulator = shutil.which("qemu-%s-static" % machine)
    if not emulator or platform.machine() == machine:
        raise Skipped("needs qemu-user-static, on another machine than " + arch)
    _, root, process = unpacked(bench, path)
    shutil.copy(emulator, root + "/emulator")
    sim = bench.twin("ping360_sim", "--udp", "0")  # as quick as the real one
    data, port, _ = filled(bench, sim)
    os.mkdir(data + "/run")
    run_it = lambda *words: contained(root, data, process) + ["/emulator"] + list(words)
    daemon = Process(bench, "sonard", run_it("/usr/sbin/sonard", "--socket", "/data/run/sonard.sock"))
    bench.processes.append(daemon)
    extension = Extension(bench, port, run_it("/usr/sbin/sonard-web", "--listen", "127.0.0.1:%d" % port, "--socket", "/data/run/sonard.sock"))
    daemon.expected = extension.expected = -15
    until(lambda: extension.answers("status"), "the daemon's answer", 60)
    check(extension.request("/")[2].startswith(b"<!DOCTYPE html>"), "no page")

    def ring():
        answer = extension.answers("sectors", distance_m=0)
        return answer and sum(s["state"] == "blocked" for s in answer["sectors"]) > 60
    until(ring, "a ring around the virtual sonar", 90)
    note("%s: %.1f MB, %d pings" % (os.path.basename(path), os.path.getsize(path) / 1e6, sim.pings()))


def arm64(bench):
    """A Raspberry Pi with a system of 64 bits."""
    emulated(bench, "arm64", "aarch64")


def armhf(bench):
    """One with a system of 32 bits."""
    emulated(bench, "armhf", "arm")


run([("blueos_" + f.__name__, f) for f in (starts, first_time, image, arm64, armhf)])
