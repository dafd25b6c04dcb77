#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""docs/pictures/extract-steps.png: the panels of `extract_steps picture`, with what each shows, scale and bearings.

  tests/tools/extract_picture.py FILE.csv OUT.png    needs build/tests/extract_steps and rsvg-convert
"""
import base64
import os
import struct
import subprocess
import sys
import zlib

LABELS = ("as sent", "median 3", "median 5", "median 3 and otsu", "median 3, otsu and clahe", "median 3 and classes", "as sent, with detections",
          "after all steps, with detections")
ACROSS, SCALE, HEAD = 4, 1.45, 30  # panels in a row; of a panel; room above each for its words
FONT = "font-family=\"DejaVu Sans, sans-serif\" font-size=\"13\""


def png(width, height, rgb):
    def part(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
    rows = b"".join(b"\0" + rgb[y * width * 3:(y + 1) * width * 3] for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + part(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            part(b"IDAT", zlib.compress(rows, 9)) + part(b"IEND", b""))


def cut(ppm, panel, size, width):
    """One panel of the picture."""
    top, left = panel // ACROSS * size, panel % ACROSS * size
    return b"".join(ppm[((top + y) * width + left) * 3:((top + y) * width + left + size) * 3] for y in range(size))


def main():
    recording, out = sys.argv[1:]
    tool = os.path.join(os.environ.get("BUILD", "build"), "tests", "extract_steps")
    ppm = subprocess.run([tool, "picture", recording], stdout=subprocess.PIPE, check=True).stdout
    _, rim, sizes, _, pixels = ppm.split(b"\n", 4)
    width, height = map(int, sizes.split())
    range_m = float(rim.split()[3])
    size = width // ACROSS
    side = size * SCALE
    radius = (size / 2 - 3) * SCALE
    svg = ["<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"%d\" height=\"%d\">"
           "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>" % (side * ACROSS, (side + HEAD) * height / size + 34)]
    for panel, label in enumerate(LABELS):
        x, y = panel % ACROSS * side, panel // ACROSS * (side + HEAD)
        data = base64.b64encode(png(size, size, cut(pixels, panel, size, width))).decode()
        svg.append("<text x=\"%g\" y=\"%g\" text-anchor=\"middle\" font-weight=\"bold\" %s>%s</text>" % (x + side / 2, y + 20, FONT, label))
        svg.append("<image x=\"%g\" y=\"%g\" width=\"%g\" height=\"%g\" xlink:href=\"data:image/png;base64,%s\"/>" % (x, y + HEAD, side, side, data))
        middle_x, middle_y = x + side / 2, y + HEAD + side / 2
        for metres in (0.5, 1.0, 1.5):
            ring = metres / range_m * radius
            svg.append("<circle cx=\"%g\" cy=\"%g\" r=\"%g\" fill=\"none\" stroke=\"#fff\" stroke-opacity=\".35\"/>" % (middle_x, middle_y, ring))
            svg.append("<text x=\"%g\" y=\"%g\" text-anchor=\"middle\" fill=\"#fff\" %s>%g m</text>" % (middle_x, middle_y + ring - 4, FONT, metres))
        for text, along, up in (("0°", 0, 1), ("90°", 1, 0), ("270°", -1, 0)):
            svg.append("<text x=\"%g\" y=\"%g\" text-anchor=\"middle\" fill=\"#fff\" %s>%s</text>" % (
                middle_x + along * (radius - 20), middle_y - up * (radius - 16) + (0 if up else 5), FONT, text))
    svg.append("<text x=\"8\" y=\"%g\" %s>0° is forward, clockwise; rim at %.3g m. Grey: no samples; brighter: stronger echo. "
               "Orange: detections.</text></svg>" % ((side + HEAD) * height / size + 20, FONT, range_m))
    subprocess.run(["rsvg-convert", "-o", out], input="".join(svg).encode(), check=True)


if __name__ == "__main__":
    main()
