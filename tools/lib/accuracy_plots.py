"""Line and bar charts as SVG, with nothing but the standard library."""

import math
from html import escape

INK = "#222222"
GRID = "#dddddd"
FONT = "font-family='DejaVu Sans, Helvetica, Arial, sans-serif'"
PANEL_W, PANEL_H = 360, 250
LEFT, TOP, GAP, BOTTOM, LEGEND_H = 62, 52, 72, 48, 20
COLOURS = {
    "paper-ds": "#999999", "paper-dp": "#555555", "unsigned": "#000000", "ternary": "#56b4e9",
    "graded": "#0072b2", "temporal": "#009e73", "combined": "#d55e00",
}


def nice_ticks(low, high, n=5):
    span = (high - low) or 1
    step = 10 ** math.floor(math.log10(span / n))
    step = next(step * k for k in (1, 2, 2.5, 5, 10, 20) if span / (step * k) <= n)
    first = math.ceil(low / step - 1e-9)
    return [round(i * step, 10) for i in range(first, math.floor(high / step + 1e-9) + 1)]


def text(x, y, content, size=12, anchor="middle", more=""):
    return (f"<text x='{x:.1f}' y='{y:.1f}' {FONT} font-size='{size}' fill='{INK}'"
            f" text-anchor='{anchor}' {more}>{escape(str(content))}</text>")


class Panel:
    """One chart. Series are dicts with label, colour, points and perhaps dash; x may be names."""

    def __init__(self, title, x_label, y_label, series, x_log=False, y_zero=True, names=None,
                 bars=False, y_max=None):
        self.title, self.x_label, self.y_label = title, x_label, y_label
        self.series, self.x_log, self.names, self.bars = series, x_log, names, bars
        ys = [y for s in series for _, y in s["points"] if math.isfinite(y)] or [0, 1]
        self.low, self.high = min(ys), max(ys)
        if y_zero:
            self.low = min(self.low, 0)
        if self.high <= self.low:
            self.high = self.low + 1
        margin = 0.06 * (self.high - self.low)
        self.high = min(self.high + margin, y_max or math.inf)
        if self.low < 0:
            self.low -= margin
        xs = range(len(names)) if names else [x for s in series for x, _ in s["points"]]
        self.xs = sorted(set(xs)) or [0, 1]

    def x(self, value):
        if self.names:
            return (value + 0.5) / len(self.names) * PANEL_W
        scale = math.log if self.x_log else float
        low, high = scale(self.xs[0]), scale(self.xs[-1])
        return 12 + (scale(value) - low) / ((high - low) or 1) * (PANEL_W - 24)

    def y(self, value):
        value = min(max(value, self.low), self.high)
        return PANEL_H * (1 - (value - self.low) / (self.high - self.low))

    def axes(self):
        parts = [f"<rect width='{PANEL_W}' height='{PANEL_H}' fill='#ffffff' stroke='{INK}'/>",
                 text(PANEL_W / 2, -10, self.title, 13, more="font-weight='bold'")]
        for tick in nice_ticks(self.low, self.high):
            y = self.y(tick)
            colour = "#888888" if tick == 0 and self.low < 0 else GRID
            parts.append(f"<line x1='0' y1='{y:.1f}' x2='{PANEL_W}' y2='{y:.1f}'"
                         f" stroke='{colour}'/>")
            parts.append(text(-6, y + 4, f"{tick:g}", 11, "end"))
        ticks = range(len(self.names)) if self.names else self.xs
        last = -math.inf
        for tick in ticks:
            x = self.x(tick)
            if x - last < 24:
                continue
            last = x
            if not self.bars:
                parts.append(f"<line x1='{x:.1f}' y1='0' x2='{x:.1f}' y2='{PANEL_H}'"
                             f" stroke='{GRID}'/>")
            label = self.names[tick] if self.names else f"{tick:g}"
            parts.append(text(x, PANEL_H + 16, label, 11))
        parts.append(text(PANEL_W / 2, PANEL_H + 36, self.x_label))
        parts.append(text(0, 0, self.y_label, more=f"transform='translate(-44,{PANEL_H / 2})"
                                                   " rotate(-90)'"))
        return parts

    def lines(self):
        parts = []
        for s in self.series:
            points = [(self.x(x), self.y(y)) for x, y in s["points"] if math.isfinite(y)]
            path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
            dash = f" stroke-dasharray='{s['dash']}'" if s.get("dash") else ""
            parts.append(f"<polyline points='{path}' fill='none' stroke='{s['colour']}'"
                         f" stroke-width='2'{dash}/>")
            if not s.get("is_law"):
                parts += [f"<circle cx='{x:.1f}' cy='{y:.1f}' r='3' fill='{s['colour']}'/>"
                          for x, y in points]
        return parts

    def blocks(self):
        parts = []
        width = PANEL_W / len(self.names) * 0.8 / len(self.series)
        for i, s in enumerate(self.series):
            for x, y in s["points"]:
                if not math.isfinite(y):
                    continue
                left = self.x(x) + (i - len(self.series) / 2) * width
                top, bottom = sorted((self.y(y), self.y(0)))
                parts.append(f"<rect x='{left:.1f}' y='{top:.1f}' width='{width * 0.92:.1f}'"
                             f" height='{bottom - top:.1f}' fill='{s['colour']}'/>")
        return parts

    def svg(self, left):
        inside = self.axes() + (self.blocks() if self.bars else self.lines())
        return [f"<g transform='translate({left},{TOP})'>"] + inside + ["</g>"]


def legend(series, width, y):
    """In as many lines as it takes; returns its height too."""
    parts, x, rows = [], LEFT, 1
    for s in series:
        needed = 40 + 7.2 * len(s["label"])
        if x + needed > width and x > LEFT:
            x, y, rows = LEFT, y + LEGEND_H, rows + 1
        dash = f" stroke-dasharray='{s['dash']}'" if s.get("dash") else ""
        parts.append(f"<line x1='{x}' y1='{y}' x2='{x + 26}' y2='{y}' stroke='{s['colour']}'"
                     f" stroke-width='3'{dash}/>")
        parts.append(text(x + 32, y + 4, s["label"], 12, "start"))
        x += needed + 12
    return parts, rows * LEGEND_H


def write(path, title, panels):
    """A row of panels; series of the same label share a line of the legend."""
    width = LEFT + len(panels) * PANEL_W + (len(panels) - 1) * GAP + 20
    shown = {s["label"]: s for panel in panels for s in panel.series}
    entries, entries_h = legend(shown.values(), width, TOP + PANEL_H + BOTTOM + 12)
    height = TOP + PANEL_H + BOTTOM + entries_h + 6
    parts = [f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}'"
             f" viewBox='0 0 {width} {height}'>",
             f"<rect width='{width}' height='{height}' fill='#ffffff'/>",
             text(width / 2, 20, title, 15, more="font-weight='bold'")]
    for i, panel in enumerate(panels):
        parts += panel.svg(LEFT + i * (PANEL_W + GAP))
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(parts + entries + ["</svg>"]) + "\n")
