"""What tools/run-accuracy renders and how it evaluates it.

A recording is a dict: its name, the conditions it was made under, and its studies. A study is one
call of `sheftool study` on it; the groups that it belongs to say which tables and plots it is for.
Seeds are 1001 and up; the parameters of the chain were chosen on seeds below 100.
"""

import math

FPS = 54
TRAVEL_M = 0.010  # of a temporal pair: before that, the chain has not seen all it uses
SCENES = ("simple_boxes", "complex_boxes", "picnic", "low_contrast")
SWEPT = ("simple_boxes", "complex_boxes", "low_contrast")
LIGHTS = ("day", "night")
# Parts of the arm's paths: name, where on it, tilt of its plane in degrees.
VARIANTS = (("circle", 0.10, 20), ("square", 0.65, 0))
DIRECTIONS = ("left", "right", "up", "down")
SPEEDS = (0.03, 0.06, 0.10, 0.18, 0.35)
THRESHOLDS = (0.15, 0.20, 0.30, 0.50)
NOISES = ("clean", "typical", "hard")
DELAYS_MS = (0, 1, 2, 3, 5)
WRONG = {  # the option of shefsim render, unit, values; 0 is the calibration as it is
    "rows": ("--misalign-px", "px", (0.25, 0.5, 1)),
    "roll": ("--misalign-deg", "deg", (0.05, 0.1, 0.2)),
    "yaw": ("--misalign-yaw-deg", "deg", (0.05, 0.1, 0.2)),
}
START_FRAMES = (1, 2, 3, 4, 6, 8)
MODES = ("paper-ds", "paper-dp", "unsigned", "ternary", "graded", "temporal", "combined")
PUBLISHED = ("paper-ds", "paper-dp", "unsigned")
COMPARED = ("unsigned", "graded", "temporal", "combined")
GROUPS = ("table", "slow", "directions", "speed", "threshold", "noise", "misalignment", "timing",
          "start", "time")


def seconds_at(speed):
    return {0.03: 0.75, 0.06: 0.6, 0.10: 0.5}.get(speed, 0.45)


def skip_at(speed):
    """Frames before a temporal pair spans its travel."""
    return math.ceil(FPS * TRAVEL_M / speed) + 1


class Plan:
    def __init__(self):
        self.recordings = {}

    def recording(self, scene, speed, light, path, phase=0.0, tilt=0, seed=1001, threshold=0.30,
                  noise="typical", seconds=None, truth_every=None, label=""):
        name = f"{scene}-{speed:g}-{light}-{path}-{phase:g}"
        if threshold != 0.30 or noise != "typical":
            name += f"-{threshold:g}-{noise}"
        name += label
        if name not in self.recordings:
            seconds = seconds or seconds_at(speed)
            truth_every = truth_every or 3
            self.recordings[name] = {
                "name": name, "scene": scene, "speed": speed, "light": light, "path": path,
                "threshold": threshold, "noise": noise, "seed": seed, "studies": {},
                "render": f"--scene {scene} --speed {speed:g} --light {light} --path {path}"
                          f" --phase {phase:g} --tilt {tilt} --seed {seed} --noise {noise}"
                          f" --threshold {threshold:g} --seconds {seconds:g}"
                          f" --truth-every {truth_every}",
            }
        return self.recordings[name]

    def variant(self, scene, speed, light, i, **more):
        path, phase, tilt = VARIANTS[i]
        return self.recording(scene, speed, light, path, phase, tilt, seed=1001 + i, **more)

    @staticmethod
    def study(recording, group, tag, modes, options="", wrong="-", skip=None, **conditions):
        study = recording["studies"].setdefault(tag, {"groups": set(), "modes": set()})
        skip = skip_at(recording["speed"]) if skip is None else skip
        study["groups"].add(group)
        study["modes"] |= set(modes)
        study["options"] = f"--profile wide --skip {skip} {options}".strip()
        study["wrong"] = wrong
        study.update(conditions)


def add_table(plan, quick):
    for group, speeds in (("table", (0.10, 0.35)), ("slow", (0.03,))):
        for scene in SCENES:
            for light in LIGHTS:
                for speed in speeds:
                    for i in range(1 if quick else len(VARIANTS)):
                        if quick and speed == 0.03 and light == "night":
                            continue
                        recording = plan.variant(scene, speed, light, i)
                        plan.study(recording, group, "base", MODES)
                        if group == "table":
                            plan.study(recording, group, "published", PUBLISHED,
                                       "--read at-mid --lag 0")
                        plan.study(recording, group, "searched", ("combined",), "--no-robot")


def add_directions(plan, quick):
    for scene in SCENES:
        for light in LIGHTS[:1] if quick else LIGHTS:
            for i, direction in enumerate(DIRECTIONS):
                recording = plan.recording(scene, 0.35, light, f"line-{direction}", seed=1011 + i,
                                           seconds=0.35)
                plan.study(recording, "directions", "base", COMPARED)
                plan.study(recording, "directions", "published", PUBLISHED, "--read at-mid --lag 0")
                if light == "night" or i > 1 or (quick and scene != "complex_boxes"):
                    continue
                plan.study(recording, "timing", "base", COMPARED, delay_ms=0)
                for delay_ms in DELAYS_MS[1:]:
                    plan.study(recording, "timing", f"late-{delay_ms}", COMPARED,
                               f"--delay {-delay_ms}", delay_ms=delay_ms)


def sweep_scenes(quick):
    return ("complex_boxes",) if quick else SWEPT


def add_sweeps(plan, quick):
    for scene in sweep_scenes(quick):
        for light in LIGHTS:
            for speed in (0.03, 0.10, 0.35) if quick else SPEEDS:
                plan.study(plan.variant(scene, speed, light, 0), "speed", "base", COMPARED)
        for speed in (0.10, 0.35):
            for threshold in (0.20, 0.30, 0.50) if quick else THRESHOLDS:
                recording = plan.variant(scene, speed, "day", 0, threshold=threshold)
                plan.study(recording, "threshold", "base", COMPARED)
            for noise in NOISES:
                plan.study(plan.variant(scene, speed, "day", 0, noise=noise), "noise", "base",
                           COMPARED)
        recording = plan.variant(scene, 0.35, "day", 0)
        plan.study(recording, "misalignment", "base", COMPARED)
        plan.study(recording, "misalignment", "unaligned", COMPARED, "--no-align")
        for factor, (option, unit, values) in WRONG.items():
            for value in values[1::2] if quick else values:
                for is_aligned in (True, False):
                    tag = f"{factor}-{value:g}{unit}{'' if is_aligned else '-unaligned'}"
                    plan.study(recording, "misalignment", tag, COMPARED,
                               "" if is_aligned else "--no-align", factor=factor, value=value,
                               aligned=is_aligned,
                               wrong=f"--scene simple_boxes --seed {recording['seed']}"
                                     f" --seconds 0.02 {option} {value:g}")


def add_start(plan, quick):
    for scene in sweep_scenes(quick):
        for speed in (0.35,) if quick else (0.10, 0.35):
            recording = plan.variant(scene, speed, "day", 0, seconds=0.2, truth_every=1,
                                     label="-start")
            for frame in START_FRAMES:
                plan.study(recording, "start", f"frame-{frame}", COMPARED, f"--frames {frame}",
                           skip=frame - 1, frame=frame)


def add_time(plan):
    recording = plan.variant("complex_boxes", 0.35, "day", 0, seconds=0.5, label="-time")
    for i in range(3):
        plan.study(recording, "time", f"run-{i + 1}", MODES)


def make(quick, only=None):
    """The recordings with the studies of the groups wanted, by name."""
    plan = Plan()
    add_table(plan, quick)
    add_directions(plan, quick)
    add_sweeps(plan, quick)
    add_start(plan, quick)
    add_time(plan)
    for recording in plan.recordings.values():
        if only:
            recording["studies"] = {tag: study for tag, study in recording["studies"].items()
                                    if only in study["groups"]}
    return {name: r for name, r in plan.recordings.items() if r["studies"]}


def lines(quick, only=None):
    """For the script: name, how to render, whether alone, and of each study tag|wrong|options, with
    tabs between. wrong is how to render a recording with another calibration, or -."""
    for recording in make(quick, only).values():
        fields = [recording["name"], recording["render"],
                  "alone" if recording["name"].endswith("-time") else "beside"]
        for tag, study in recording["studies"].items():
            modes = ",".join(mode for mode in MODES if mode in study["modes"])
            fields.append(f"{tag}|{study['wrong']}|--modes {modes} {study['options']}")
        yield "\t".join(fields)
