"""The tables of docs/accuracy.md, as Markdown. Each function returns one, or None where nothing
that it needs was measured."""

import math

from accuracy_plan import (COMPARED, DELAYS_MS, DIRECTIONS, LIGHTS, MODES, NOISES, PUBLISHED,
                           SCENES, SPEEDS, START_FRAMES, THRESHOLDS, WRONG)

BEST = "combined"


def number(value, digits=2, sign=False):
    if value is None or math.isnan(value):
        return "-"
    if math.isinf(value):
        return "> 50"
    return f"{value:{'+' if sign else ''}.{digits}f}"


def pair(figures):
    return f"{number(figures['bad_1'])} / {number(figures['depth'])}"


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|---" * len(header) + "|"]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def measured(results):
    """What the figures are of."""
    names = {study["name"] for study in results.studies}
    parts = {study["path"] for study in results.select("table")}
    swept = [scene for scene in SCENES if results.select("threshold", scene=scene)]
    return (f"Measured on {len(names)} recordings: the modes on {len(SCENES)} scenes and"
            f" {len(parts)} {'part' if len(parts) == 1 else 'parts'} of the arm's path for each"
            " speed and light, threshold, noise, calibration and the first frames on "
            + ", ".join(f"`{scene}`" for scene in swept) + ".")


def _limit(measured, required, reach=None):
    """How a figure that should be small compares: required, reach for, measured, verdict."""
    verdict = ("**missed**" if not measured <= required
               else "met" if reach is None or measured > reach else "reached")
    return [number(required, 1), "-" if reach is None else number(reach, 1), number(measured),
            verdict]


def _floor(measured, required, digits):
    """The same of one that should be large."""
    return [f">= {required:g}", "-", number(measured, digits),
            "met" if measured >= required else "**missed**"]


def requirements(results):
    """What is asked of the mode that runs live, and what came out."""
    everything = results.select("table", tag="base")
    slow_ones = results.select("slow", tag="base")
    lines = results.select("directions", tag="base")
    if not (everything and slow_ones and lines):
        return None
    rows = []
    for name, chosen, bad_1, depth in (
            ("all four scenes", SCENES, (5, 2.5), (1.5, 0.9)),
            ("`simple_boxes`, `complex_boxes`", SCENES[:2], (3, 1.6), (1.3, 0.7)),
            ("`low_contrast`", SCENES[3:], (9, 4), (3, 1.6)),
            ("`picnic`", ("picnic",), None, None)):
        figures = results.pool(results.select("table", tag="base", scene=chosen), BEST)
        for key, label, limits in (("bad_1", "bad-1, %", bad_1),
                                   ("depth", "median depth error, %", depth)):
            rows.append([name, label] + (_limit(figures[key], *limits) if limits
                                         else ["-", "-", number(figures[key]), ""]))
    figures = results.pool(everything, BEST)
    rows.append(["75 % most confident", "bad-1, %"] + _limit(figures["confident_bad_1"], 1.5, 0.5))
    rows.append(["75 % most confident", "median depth error, %"]
                + _limit(figures["confident_depth"], 1.2))
    rows.append(["0.03 m/s", "bad-1, %"] + _limit(results.pool(slow_ones, BEST)["bad_1"], 8, 4))
    figures = results.pool(lines, BEST)
    for direction in DIRECTIONS:
        bias = figures[f"bias_{direction}"]
        cells = _limit(abs(bias), 1, 0.3)
        rows.append([f"0.35 m/s, moving {direction}", "bias, % of depth"] + cells[:2]
                    + [number(bias, sign=True), cells[3]])
    gain = results.pool(everything, "unsigned")["bad_1"] / results.pool(everything, BEST)["bad_1"]
    rows.append(["`unsigned` over `combined`", "bad-1, times"] + _floor(gain, 1.5, 2))
    found = results.pool(results.select("table", tag="searched")
                         + results.select("slow", tag="searched"), BEST)["direction_found"]
    rows.append(["motion found without a robot", "% of frames within 10 degrees"]
                + _floor(found, 95, 1))
    return table(["where", f"figure of `{BEST}`", "required", "reach for", "measured", ""], rows)


def _mode_row(name, figures, milliseconds):
    return [name] + [number(figures[key], sign=key == "bias") for key in
                     ("bad_1", "bad_2", "depth", "bias", "confident_bad_1", "confident_depth",
                      "away_bad_1")] + [number(milliseconds, 1)]


def modes(results):
    """All modes side by side, pooled."""
    studies = results.select("table", tag="base")
    published = results.select("table", tag="published")
    times = results.select("time")
    if not studies:
        return None
    rows = [_mode_row(f"`{mode}`, read at mid-exposure", results.pool(published, mode), math.nan)
            for mode in PUBLISHED]
    rows += [_mode_row(f"`{mode}`", results.pool(studies, mode), results.milliseconds(times, mode))
             for mode in MODES]
    n = results.pool(studies, BEST)
    return (table(["mode", "bad-1 %", "bad-2 %", "depth error %", "bias %", "75 %: bad-1 %",
                   "75 %: depth %", "no jump: bad-1 %", "ms a frame"], rows)
            + f"\n\n{n['recordings']} recordings, {n['frames']} frames scored.")


def scenes(results):
    """bad-1 / median depth error, by scene, speed and light."""
    rows = []
    for scene in SCENES:
        for speed in (0.10, 0.35):
            for light in LIGHTS:
                studies = results.select("table", tag="base", scene=scene, speed=speed, light=light)
                if studies:
                    rows.append([f"`{scene}`", f"{speed:.2f}", light,
                                 number(results.event_rate(studies), 1)]
                                + [pair(results.pool(studies, mode)) for mode in
                                   ("paper-ds", "paper-dp", "unsigned", "ternary", "graded",
                                    "temporal", "combined")])
    return table(["scene", "m/s", "light", "Mev/s"] + list(MODES), rows) if rows else None


def slow(results):
    rows = []
    for scene in SCENES + (SCENES,):
        studies = results.select("slow", tag="base", scene=scene)
        if studies:
            rows.append([f"`{scene}`" if isinstance(scene, str) else "all"]
                        + [pair(results.pool(studies, mode)) for mode in MODES])
    return table(["0.03 m/s"] + list(MODES), rows) if rows else None


def directions(results):
    """Bias by direction of motion at 0.35 m/s."""
    rows = []
    for mode in ("paper-dp", "unsigned"):
        figures = results.pool(results.select("directions", tag="published"), mode)
        rows.append((f"all, `{mode}`, read at mid-exposure", figures))
    for mode in COMPARED:
        rows.append((f"all, `{mode}`",
                     results.pool(results.select("directions", tag="base"), mode)))
    for scene in SCENES:
        for light in LIGHTS:
            studies = results.select("directions", tag="base", scene=scene, light=light)
            if studies:
                rows.append((f"`{scene}`, {light}, `{BEST}`", results.pool(studies, BEST)))
    rows = [[name] + [number(figures.get(f"bias_{direction}"), sign=True)
                      for direction in DIRECTIONS] for name, figures in rows]
    return (table(["bias, % of depth"] + list(DIRECTIONS), rows)
            if results.select("directions") else None)


def searched(results):
    """How often the direction is right without poses, and what it costs."""
    rows = []
    for group, speed in (("slow", 0.03), ("table", 0.10), ("table", 0.35)):
        for scene in SCENES + (SCENES,):
            with_poses = results.select(group, tag="base", scene=scene, speed=speed)
            without = results.select(group, tag="searched", scene=scene, speed=speed)
            if without:
                figures = results.pool(without, BEST)
                rows.append([f"{speed:.2f}", f"`{scene}`" if isinstance(scene, str) else "all",
                             number(figures["direction_found"], 1),
                             pair(results.pool(with_poses, BEST)), pair(figures)])
    return table(["m/s", "scene", "found to 10 degrees, % of frames", "with poses", "without"],
                 rows) if rows else None


def _sweep(results, group, name, values, **conditions):
    rows = []
    for value, label in values:
        studies = results.select(group, tag="base", **conditions, **{name: value})
        if studies:
            rows.append([label, number(results.event_rate(studies), 1)]
                        + [pair(results.pool(studies, mode)) for mode in COMPARED]
                        + [number(results.pool(studies, BEST)["bias"], sign=True)])
    return rows


def speed(results):
    rows = []
    for light in LIGHTS:
        rows += [[light] + row for row in _sweep(results, "speed", "speed",
                                                 [(v, f"{v:.2f}") for v in SPEEDS], light=light)]
    return table(["light", "m/s", "Mev/s"] + list(COMPARED) + ["bias %"], rows) if rows else None


def threshold(results):
    rows = []
    for at in (0.10, 0.35):
        rows += [[f"{at:.2f}"] + row for row in
                 _sweep(results, "threshold", "threshold",
                        [(v, f"{v:.2f}") for v in THRESHOLDS], speed=at)]
    return table(["m/s", "threshold", "Mev/s"] + list(COMPARED) + ["bias %"],
                 rows) if rows else None


def noise(results):
    rows = []
    for at in (0.10, 0.35):
        rows += [[f"{at:.2f}"] + row for row in
                 _sweep(results, "noise", "noise", [(v, v) for v in NOISES], speed=at)]
    return table(["m/s", "noise", "Mev/s"] + list(COMPARED) + ["bias %"], rows) if rows else None


def misaligned(results, factor, value, aligned):
    if value == 0:
        return results.select("misalignment", tag="base" if aligned else "unaligned")
    return results.select("misalignment", factor=factor, value=value, aligned=aligned)


def misalignment(results):
    rows = []
    for factor, (_, unit, values) in WRONG.items():
        for value in (0,) + values:
            studies = misaligned(results, factor, value, True)
            unaligned = misaligned(results, factor, value, False)
            if studies:
                rows.append([factor, f"{value:g} {unit}"]
                            + [pair(results.pool(studies, mode)) for mode in COMPARED]
                            + [pair(results.pool(unaligned, BEST)),
                               number(results.pool(studies, BEST)["bias"], sign=True)])
    return table(["wrong", "by"] + list(COMPARED) + [f"{BEST}, `--no-align`", "bias %"],
                 rows) if rows else None


def timing(results):
    rows = []
    for late in DELAYS_MS:
        studies = results.select("timing", delay_ms=late)
        if studies:
            figures = results.pool(studies, BEST)
            rows.append([f"{late}"] + [pair(results.pool(studies, mode)) for mode in COMPARED]
                        + [number(figures.get("bias_left"), sign=True),
                           number(figures.get("bias_right"), sign=True)])
    return table(["events late, ms"] + list(COMPARED) + ["bias left %", "bias right %"],
                 rows) if rows else None


def start(results):
    speeds = [at for at in (0.10, 0.35) if results.select("start", speed=at)]
    rows = []
    for frame in START_FRAMES:
        cells = [f"{frame}"]
        for at in speeds:
            figures = results.pool(results.select("start", speed=at, frame=frame), BEST)
            cells += [pair(figures), number(figures["bias"], sign=True)]
        rows.append(cells)
    header = ["frame"]
    for at in speeds:
        header += [f"{at:.2f} m/s", "bias %"]
    return table(header, rows) if speeds else None


ALL = {make.__name__: make for make in (
    measured, requirements, modes, scenes, slow, directions, searched, speed, threshold, noise,
    misalignment, timing, start)}
