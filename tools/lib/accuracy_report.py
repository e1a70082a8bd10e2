"""Tables, plots and the pooled figures of what was measured."""

import json
import os

import accuracy_plots as plots
import accuracy_tables as tables
from accuracy_plan import (COMPARED, DELAYS_MS, LIGHTS, MODES, NOISES, SCENES, SPEEDS, THRESHOLDS,
                           WRONG)
from accuracy_pool import Results

BASELINE_M = 0.06544
ERROR = "median depth error, %"
BAD = "bad-1, %"
BIAS = "bias, % of depth"
PANELS = (("depth", "Depth error", ERROR), ("bad_1", "Outliers", BAD))


def series(label, points, mode=None, colour=None, dash=None, is_law=False):
    return {"label": label, "colour": colour or plots.COLOURS[mode], "points": points,
            "dash": dash, "is_law": is_law}


def curve(results, mode, key, points):
    """Points are pairs of an x and the studies there."""
    return [(x, results.pool(studies, mode)[key]) for x, studies in points if studies]


def by_mode(results, key, points, modes=COMPARED):
    return [series(mode, curve(results, mode, key, points), mode) for mode in modes]


def two_panels(results, points, x_label, x_log=False, names=None, bars=False, modes=COMPARED):
    return [plots.Panel(title, x_label, y_label, by_mode(results, key, points, modes), x_log=x_log,
                        names=names, bars=bars)
            for key, title, y_label in PANELS]


def plot_modes(results):
    points = [(i, results.select("table", tag="base", scene=scene))
              for i, scene in enumerate(SCENES)]
    if not any(studies for _, studies in points):
        return None
    return "All modes, 0.10 and 0.35 m/s, both lights", two_panels(
        results, points, "scene", names=SCENES, bars=True, modes=MODES)


def plot_speed(results):
    panels = []
    for key, title, label in PANELS:
        shown = []
        for light, dash in zip(LIGHTS, (None, "5 4")):
            points = [(v, results.select("speed", speed=v, light=light)) for v in SPEEDS]
            shown += [series(f"{mode}, {light}", curve(results, mode, key, points), mode, dash=dash)
                      for mode in ("unsigned", "temporal", "combined")]
        panels.append(plots.Panel(title, "speed of the camera, m/s", label, shown, x_log=True))
    return ("Speed and light", panels) if results.select("speed") else None


def plot_threshold(results):
    panels = []
    for at in (0.10, 0.35):
        points = [(v, results.select("threshold", threshold=v, speed=at)) for v in THRESHOLDS]
        panels.append(plots.Panel(f"{at:.2f} m/s", "contrast threshold, ln units", ERROR,
                                  by_mode(results, "depth", points)))
    points = [(v, results.select("threshold", threshold=v, speed=0.10)) for v in THRESHOLDS]
    panels.append(plots.Panel("0.10 m/s", "contrast threshold, ln units", BAD,
                              by_mode(results, "bad_1", points)))
    title = "Contrast threshold of the event camera"
    return (title, panels) if results.select("threshold") else None


def plot_noise(results):
    panels = []
    for at in (0.10, 0.35):
        points = [(i, results.select("noise", noise=v, speed=at)) for i, v in enumerate(NOISES)]
        panels.append(plots.Panel(f"{at:.2f} m/s", "noise of the event camera", BAD,
                                  by_mode(results, "bad_1", points), names=NOISES, bars=True))
    return ("Noise of the event camera", panels) if results.select("noise") else None


def plot_misalignment(results):
    panels = []
    for factor, (_, unit, values) in WRONG.items():
        shown = []
        for aligned, dash in ((True, None), (False, "5 4")):
            points = [(v, tables.misaligned(results, factor, v, aligned)) for v in (0,) + values]
            shown += [series(mode + ("" if aligned else ", --no-align"),
                             curve(results, mode, "depth", points), mode, dash=dash)
                      for mode in ("unsigned", "combined")]
        panels.append(plots.Panel(f"Event camera: {factor}", f"wrong by, {unit}", ERROR, shown))
    return ("Wrong calibration, 0.35 m/s", panels) if results.select("misalignment") else None


def plot_timing(results):
    points = [(v, results.select("timing", delay_ms=v)) for v in DELAYS_MS]
    law = [(v, 100 * 0.35 * v * 1e-3 / BASELINE_M) for v in DELAYS_MS]
    bias = [series(f"moving {way}", curve(results, "combined", f"bias_{way}", points),
                   colour=colour) for way, colour in (("left", "#d55e00"), ("right", "#0072b2"))]
    bias.append(series("v T / b", law, colour="#888888", dash="2 3", is_law=True))
    bias.append(series("v T / b", [(x, -y) for x, y in law], colour="#888888", dash="2 3",
                       is_law=True))
    panels = [plots.Panel("Bias, combined", "events late by, ms", BIAS, bias),
              plots.Panel("Depth error", "events late by, ms", ERROR,
                          by_mode(results, "depth", points))]
    return ("Timing error, 0.35 m/s", panels) if results.select("timing") else None


PLOTS = {"modes": plot_modes, "speed": plot_speed, "threshold": plot_threshold,
         "noise": plot_noise, "misalignment": plot_misalignment, "timing": plot_timing}


def figures_json(results):
    """Every study's conditions and figures, by mode."""
    studies = []
    for study in results.studies:
        kept = {key: study[key] for key in
                ("name", "tag", "scene", "speed", "light", "path", "seed", "threshold", "noise",
                 "factor", "value", "aligned", "delay_ms", "frame") if key in study}
        studies.append(kept | {
            "groups": sorted(study["groups"]), "options": study["options"],
            "event_rate_mev_s": results.event_rates[study["name"]],
            "modes": {mode: results.pool([study], mode)
                      for mode in MODES if mode in study["modes"]}})
    pooled = {f"{group}, {tag}": {mode: results.pool(results.select(group, tag=tag), mode)
                                  for mode in modes}
              for group, tag, modes in (("table", "base", MODES), ("slow", "base", MODES),
                                        ("directions", "base", COMPARED))
              if results.select(group, tag=tag)}
    return {"kind": "accuracy", "machine": results.machine, "pooled": pooled, "studies": studies}


def write(plan, results_folder, out):
    results = Results(plan, results_folder)
    parts = []
    made_tables = {name: make(results) for name, make in tables.ALL.items()}
    for name, made in made_tables.items():
        if made:
            parts.append(f"## {name}\n\n<!-- accuracy: {name} -->\n{made}\n<!-- end -->\n")
    with open(os.path.join(out, "accuracy.md"), "w", encoding="utf-8") as file:
        file.write("# Accuracy on simulated recordings\n\n" + "\n".join(parts))
    for name, make in PLOTS.items():
        made = make(results)
        if made:
            plots.write(os.path.join(out, name + ".svg"), *made)
    with open(os.path.join(out, "accuracy.json"), "w", encoding="utf-8") as file:
        json.dump(figures_json(results), file, indent=1, default=str)
        file.write("\n")
    print(made_tables["requirements"] or "")
    print(f"\nTables {out}/accuracy.md, plots {out}/*.svg, all figures {out}/accuracy.json")
