#!/usr/bin/env python3
"""Draws what alpha_curve prints: error against CPU time, both axes logarithmic.

  build/bench/bin/alpha_curve | tests/bench/alpha_plot.py docs/images/alpha_curve.svg
"""
import csv
import math
import sys

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 760, 460, 70, 200, 30, 50
COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00"]  # told apart by the colour-blind too (Okabe & Ito)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    rows = list(csv.DictReader(sys.stdin, delimiter="\t"))
    if not rows:
        sys.exit("alpha_plot.py: nothing to draw")
    times = [float(r["cpu_s"]) for r in rows]
    errors = [float(r["rms"]) for r in rows]
    x0, x1 = math.log10(min(times)) - 0.05, math.log10(max(times)) + 0.05
    y0, y1 = math.log10(min(errors)) - 0.05, math.log10(max(errors)) + 0.05

    def x(value):
        return LEFT + (math.log10(value) - x0) / (x1 - x0) * (WIDTH - LEFT - RIGHT)

    def y(value):
        return HEIGHT - BOTTOM - (math.log10(value) - y0) / (y1 - y0) * (HEIGHT - TOP - BOTTOM)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for low, high, horizontal in ((x0, x1, True), (y0, y1, False)):
        for power in range(math.floor(low), math.ceil(high) + 1):
            for digit in (1, 2, 5):
                value = digit * 10.0 ** power
                if not low <= math.log10(value) <= high:
                    continue
                if horizontal:
                    out.append(f'<path d="M{x(value):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>'
                               f'<text x="{x(value):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{value:g}</text>')
                else:
                    out.append(f'<path d="M{LEFT} {y(value):.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>'
                               f'<text x="{LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:g}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 12}" text-anchor="middle">CPU seconds of the bake, 64 voxels</text>')
    out.append(f'<text transform="translate(18 {HEIGHT / 2}) rotate(-90)" text-anchor="middle">alpha: rms error</text>')
    models = list(dict.fromkeys(r["model"] for r in rows))
    line = TOP + 10
    for i, model in enumerate(models):
        for pattern in dict.fromkeys(r["pattern"] for r in rows):
            points = [r for r in rows if r["model"] == model and r["pattern"] == pattern]
            color, dashed = COLORS[i % len(COLORS)], ' stroke-dasharray="5 4"' if pattern == "grid" else ""
            path = " ".join(f"{x(float(r['cpu_s'])):.1f},{y(float(r['rms'])):.1f}" for r in points)
            out.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="1.6"{dashed}/>')
            for r in points:
                cx, cy = x(float(r["cpu_s"])), y(float(r["rms"]))
                out.append(f'<circle cx="{cx:.1f}" cy="{cy:.1f}" r="2.6" fill="{color}"/>')
                if pattern == "lattice" and r["samples"] in ("1", "2", "4", "8", "16"):
                    out.append(f'<text x="{cx + 5:.1f}" y="{cy - 5:.1f}" font-size="10" fill="{color}">{r["samples"]}</text>')
            out.append(f'<path d="M{WIDTH - RIGHT + 14} {line}h26" stroke="{color}" stroke-width="1.6"{dashed}/>'
                       f'<text x="{WIDTH - RIGHT + 46}" y="{line + 4}">{model}, {pattern}</text>')
            line += 18
    out.append("</svg>")
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
