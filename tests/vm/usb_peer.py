#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""usb_peer.py SOCKET PLUG SIM - a virtual Ping360 behind the USB adapter of a virtual machine: plugged in while the
file PLUG is there. The emulator plugs its adapter in while somebody is connected to SOCKET."""
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import termios
import time
import tty

socket_path, plug, program = sys.argv[1:]


def carry(usb, sonar):
    """Bytes both ways until the plug is pulled or the emulator is gone."""
    while os.path.exists(plug):
        for ready in select.select([usb, sonar], [], [], 0.1)[0]:
            if ready is usb:
                data = usb.recv(4096)
                if not data:
                    return
                os.write(sonar, data)
            else:
                usb.sendall(os.read(sonar, 4096))


def session(sonar):
    with socket.socket(socket.AF_UNIX) as usb:
        try:
            usb.connect(socket_path)
            termios.tcflush(sonar, termios.TCIFLUSH)  # an adapter without power holds nothing
            carry(usb, sonar)
        except OSError:
            pass


def stop(*_):
    raise SystemExit


signal.signal(signal.SIGTERM, stop)
with tempfile.TemporaryDirectory() as folder:
    link = os.path.join(folder, "sonar")
    with subprocess.Popen([program, "--link", link, "--scene", "box"], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE) as sim:
        try:
            sim.stdout.readline()
            sonar = os.open(link, os.O_RDWR | os.O_NOCTTY)
            tty.setraw(sonar)
            while True:
                if os.path.exists(plug):
                    session(sonar)
                time.sleep(0.1)
        finally:
            sim.terminate()
