#!/usr/bin/env python3
"""Small inputs of kinds that go wrong, and what is right for each. Exit 77: the recordings are absent.
  run_case.py PROGRAM FOLDER [CASE ...]      FOLDER: with the recordings; without CASE: all, one line each
  run_case.py --list"""
import math
import pathlib
import subprocess
import sys
import tempfile
import time

from judge import Result, poses

ROOM = "mirror/B07_270"  # the same room and path as of the logs and bags without a truth of their own


def fail_unless(condition, text):
    return [] if condition else [text]


def near(r, most):
    return fail_unless(r.ate <= most, f"ATE {r.ate:.3f} m, at most {most}")


def says(r, pattern):
    return fail_unless(r.said(pattern), f"no warning like /{pattern}/")


def refused(r, pattern):
    """Exit 2 and one line that says why."""
    import re
    lines = [line for line in r.log.splitlines() if line.strip()]
    return (fail_unless(r.exit == 2, f"exit {r.exit}, expected 2") or
            fail_unless(re.search(pattern, r.log, re.I), f"no line like /{pattern}/: {lines[-1:]}"))


def fine(r):
    return fail_unless(r.exit == 0, f"exit {r.exit}: {r.log.strip().splitlines()[-1:]}")


def either(*all_problems):
    return [] if any(not p for p in all_problems) else [" and ".join(sum(all_problems, []))]


def off(r, most):
    share = r.occupied_off()
    return fail_unless(share <= most, f"{100 * share:.1f} % of the occupied cells off, at most {100 * most}")


def way(r, aim, slack):
    return fail_unless(abs(r.way() - aim) <= slack, f"path of {r.way():.2f} m, expected {aim} +- {slack}")


def end_yaw_of_gap(r):
    """By the wheels' counters -71 degrees, by the whole log's map -78, of a coasting robot -23."""
    rows = [line.split() for line in (r.folder / "trajectory.txt").read_text().splitlines()
            if line[:1] not in "#"]
    yaw = [2 * math.atan2(float(row[6]), float(row[7])) for row in rows]
    stamps = [float(row[0]) for row in rows]
    hole = max(range(1, len(rows)), key=lambda i: stamps[i] - stamps[i - 1])
    turn = math.degrees(math.remainder(yaw[hole] - yaw[hole - 1], 2 * math.pi))
    return fail_unless(abs(turn + 75) < 12, f"turn across the hole {turn:.1f} degrees, expected -63 to -87")


def turns_off_wheels(r, most):
    """The turn of every step, against that of the wheels of the log (ROBOTLASER1)."""
    wheels = []
    for line in r.source.read_text().splitlines():
        word = line.split()
        remissions = 9 + int(word[8])
        wheels.append(float(word[remissions + 1 + int(word[remissions]) + 5]))
    rows = [line.split() for line in (r.folder / "trajectory.txt").read_text().splitlines()
            if line[:1] not in "#"]
    yaw = [2 * math.atan2(float(row[6]), float(row[7])) for row in rows]
    steps = zip(zip(yaw, yaw[1:]), zip(wheels, wheels[1:]))
    off = max(abs(math.degrees(math.remainder((b - a) - (d - c), 2 * math.pi)))
              for (a, b), (c, d) in steps)
    return fail_unless(off <= most, f"a step turns {off:.1f} degrees off the wheels, at most {most}")


def step_near(r, index, expected, most):
    """The step up to a pose, against what the wheels measured."""
    path = poses(r.folder / "trajectory.txt")
    step = [b - a for a, b in zip(path[index - 1][1:3], path[index][1:3])]
    off = math.dist(step, expected)
    return fail_unless(off <= most, f"step {index} is {off:.2f} m off the wheels', at most {most}")


def no_reading_beyond(r, most):
    far = [c for line in (r.folder / "scans.csv").read_text().splitlines() if line[:1] not in "#t"
           for c in line.split(",")[5:] if c and float(c) > most and not math.isinf(float(c))]
    return fail_unless(not far, f"{len(far)} ranges beyond {most} m in scans.csv")


# name: (input, truth's folder or None, what is right)
CASES = {
    "aces_gap": ("aces_gap_min.clf", None, lambda r: fine(r) or end_yaw_of_gap(r)),
    "fhw_head": ("fhw_head_3600.log", None, lambda r: fine(r) or fail_unless(
        "scanner_sweep_ms" not in r.metrics["counts"], "a scan duration was found")),
    "flirt_fr079": ("flirt_fr079_344_347.log", None, lambda r: fine(r) or step_near(
        r, 3, (-0.053486, -0.265007), 0.15)),
    "frclinic": ("frclinic_5090_5110.clf", None, lambda r: fine(r) or turns_off_wheels(r, 8)),
    "acapulco_max": ("acapulco_max_5115.log", None, lambda r: fine(r) or no_reading_beyond(r, 51)),
    "narrow_aperture": ("narrow_aperture.rawlog", None, lambda r: fine(r) or says(r, "field_of_view|aperture")),
    "turtlebot3": ("turtlebot3.bag", None, fine),
    "bag_equal_stamps": ("bag_equal_stamps/sm_B36.bag", ROOM, lambda r: fine(r) or off(r, 0.005)),
    "promise_cx_nan": ("broken_promise/sm_B83_cxnan.bag", None, lambda r: refused(r, r"camera_info.*nan|K.*nan")),
    "promise_denormal": ("broken_promise/sm_B83_den", None, lambda r: refused(r, r"fx.*e-3")),
    "d65535": ("d65535", None, lambda r: either(
        refused(r, "65535"), fine(r) or no_reading_beyond(r, 60) or says(r, "65535"))),
    "focal_of_full_size": ("focal_of_full_size/min_B73_fxonly_9", "focal_of_full_size/min_B73_fxonly_9",
                           lambda r: fine(r) or says(r, "focal|image size")),
    "fov_of_param_421": ("fov_of_PARAM/B105_421.log", ROOM, lambda r: fine(r) or near(r, 0.05)),
    "fov_of_param_90": ("fov_of_PARAM/B105_90.log", ROOM, lambda r: fine(r) or near(r, 0.05)),
    "hang": ("hang/sm_B85", "hang/sm_B85", lambda r: fail_unless(r.exit in (0, 2), f"exit {r.exit}")),
    "leap_5m": ("leap_5m/min_B61_camleap5_24", "leap_5m/min_B61_camleap5_24",
                lambda r: fine(r) or either(near(r, 0.1), says(r, "leap"))),
    "mirror": (ROOM, ROOM, lambda r: fine(r) or near(r, 0.02) or says(r, "mirror|clockwise|upside")),
    "mm_floats": ("mm_floats/sm_B75_mm.bag", None, lambda r: either(
        refused(r, "millimet"), fine(r) or says(r, "millimet"))),
    "narrow_scan_no_wheels": ("narrow_scan_no_wheels/B29_nw", "narrow_scan_no_wheels/B29_nw",
                              lambda r: fine(r) or either(near(r, 0.2), says(r, "lost|open direction|direction"))),
    "occupancy_bar": ("occupancy_bar/ramp_5", "occupancy_bar/ramp_5", lambda r: fine(r) or off(r, 0.01)),
    "right_image_late": ("right_image_late/sm_B44", "right_image_late/sm_B44",
                         lambda r: either(refused(r, "left|right"), fine(r) or says(r, "left and right|late"))),
    "swapped": ("swapped/sm_B82_swap", "swapped/sm_B82_swap",
                lambda r: either(refused(r, "swapped"), fine(r) or says(r, "swapped"))),
    "sweep_200deg": ("sweep_200deg/B62_sweep", "sweep_200deg/B62_sweep",
                     lambda r: fine(r) or off(r, 0.03)),
    "two_lasers": ("two_lasers_one_topic/B39_one.bag", ROOM, lambda r: either(
        refused(r, "frame"), fine(r) or way(r, 14, 0.5))),
    "two_robots": ("two_robots/B53_twomount.bag", ROOM, lambda r: fine(r) or says(r, "two|robot2")),
    "upside_down": ("upside_down/min_B58_unsaid_9", "upside_down/min_B58_unsaid_9",
                    lambda r: fine(r) or says(r, "upside")),
}
LONGEST_S = 90


def run(program, folder, name):
    """The run's problems, one line each."""
    source, truth, right = CASES[name]
    with tempfile.TemporaryDirectory() as out:
        command = [program, "map", folder / source, "--output", f"{out}/map", "--quiet"]
        begin = time.monotonic()
        try:
            done = subprocess.run(list(map(str, command)), stdin=subprocess.DEVNULL, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=LONGEST_S)
        except subprocess.TimeoutExpired:
            return [f"not done after {LONGEST_S} s"], LONGEST_S
        result = Result(f"{out}/map", folder / truth if truth else None)
        result.source = folder / source
        # Names of cases are no answers.
        result.exit, result.log = done.returncode, done.stdout.replace(str(folder / source), "INPUT")
        if "broken promise" in done.stdout:
            return ["a broken promise: " + done.stdout.strip().splitlines()[-1]], 0
        return right(result), time.monotonic() - begin


def main():
    if sys.argv[1:] == ["--list"]:
        print("\n".join(CASES))
        return 0
    program, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    if not (folder / "README.md").exists():
        print(f"skipped: no recordings at {folder}")
        return 77
    failed = 0
    names = sys.argv[3:] or list(CASES)
    for name in names:
        problems, seconds = run(program, folder, name)
        print(f"{name:<24}{seconds:6.1f} s  {'; '.join(problems) or 'right'}", flush=True)
        failed += bool(problems)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
