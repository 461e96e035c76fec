"""Runs one case: simulate, spoil, map, judge."""
import dataclasses
import hashlib
import json
import math
import random
import re
import resource
import shutil
import signal
import subprocess
import threading

from . import judge, scenes
from .recording import SECOND, Recording

CPU_LIMIT = 60     # s of work after which a program hangs
WALL_LIMIT = 900   # s, where other work slows it down
LOST = 0.01        # share of frames and scans without a pose that must be said
RIGHT, SAID, POOR, SILENT = "right", "said", "poor message", "silently wrong"
ALARM, HANG, BROKEN = "false alarm", "hang", "broken promise"


@dataclasses.dataclass
class Result:
    name: str
    group: str
    outcome: str
    ate: float = math.nan
    ate_window: float = math.nan
    twin: float = math.nan
    why: str = ""
    warnings: list = dataclasses.field(default_factory=list)  # ids, or texts without them
    message: str = ""                                         # exit 2: its line
    seconds: float = 0.0
    base: str = ""


@dataclasses.dataclass
class Run:
    code: int
    text: str
    seconds: float
    hang: bool


def limited():
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT, CPU_LIMIT + 5))


def run(command, log):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen([str(c) for c in command], stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               errors="replace", preexec_fn=limited)
    hang = False
    try:
        out, err = process.communicate(timeout=WALL_LIMIT)
    except subprocess.TimeoutExpired:
        process.kill()
        out, err = process.communicate()
        hang = True
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    hang = hang or process.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
    with open(log, "a") as file:
        print("$", *command, file=file)
        print(out + err + f"exit {process.returncode}", file=file)
    return Run(process.returncode, err, after.ru_utime - before.ru_utime, hang)


class Bench:
    def __init__(self, program, output, seed, again=False):
        self.program, self.output, self.seed = program, output, seed
        self.again = again  # judges what an earlier run left
        self._lock = threading.RLock()
        self._truths, self._twins, self._simulated = {}, {}, {}
        if not again:
            shutil.rmtree(output, ignore_errors=True)
        output.mkdir(parents=True, exist_ok=True)

    # Simulations, shared between cases.

    def simulate(self, base, settings, variant):
        """Folder of a base scene; its seed is the variant's."""
        scene, usual, _ = scenes.BASES[base]
        every = {**usual, **settings}
        key = json.dumps([base, variant, sorted((k, str(v)) for k, v in every.items())])
        with self._lock:
            if key not in self._simulated:
                short = hashlib.md5(key.encode()).hexdigest()[:8]
                folder = self.output / "simulated" / f"{base}.{variant}.{short}"
                self._simulated[key] = folder / "data"
                if self.again and (folder / "data/truth.yaml").exists():
                    return folder / "data"
                folder.mkdir(parents=True, exist_ok=True)
                sway, swell = self._hall(every)
                if scene == "hall":
                    scene = scenes.write_hall(folder / "scene", sway, **swell)
                words = [w for k, v in every.items() if not k.startswith("hall.")
                         for w in ("--set", f"{k}={v}")]
                seed = random.Random(f"{self.seed} {base} {variant}").randrange(1, 10**6)
                done = run([self.program, "simulate", scene, "--seed", seed, "--quiet",
                            "--output", folder / "data", *words], folder / "log.txt")
                if done.code:
                    raise RuntimeError(f"{folder}/log.txt: {done.text.strip()}")
            return self._simulated[key]

    @staticmethod
    def _hall(settings):
        sway = {k[len("hall.sway_"):]: v for k, v in settings.items()
                if k.startswith("hall.sway_")}
        swell = {{"hall.swell_m": "height", "hall.swell_length": "length"}[k]: v
                 for k, v in settings.items() if k.startswith("hall.swell")}
        return sway, swell

    def truth(self, data, camera):
        key = (str(data), camera)
        with self._lock:
            if key not in self._truths:
                there = (data / "truth_reachable.pfm").exists()
                self._truths[key] = judge.TruthGrid(data, camera) if there else None
            return self._truths[key]

    def recording(self, data):
        epoch = random.Random(f"{self.seed} epoch").randrange(10**9, 15 * 10**8)
        return Recording(data, epoch * SECOND)

    # Cases.

    def map(self, recording, kind, folder):
        """Result of `map`: how it ended, its warnings."""
        kept = folder / "run.json"
        if self.again and kept.exists():
            done = Run(**json.loads(kept.read_text()))
            return done, self.warnings(folder / "map" / "metrics.json", done.text)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        path = recording.write(kind, folder / "input")
        options = []
        if recording.extra_calibration:
            file = folder / "calibration.yaml"
            file.write_text(recording.extra_calibration)
            options = ["--calibration", file]
        done = run([self.program, "map", path, "--output", folder / "map", "--quiet",
                    "--threads", 1, *options, *recording.map_options], folder / "log.txt")
        kept.write_text(json.dumps(vars(done)))
        return done, self.warnings(folder / "map" / "metrics.json", done.text)

    @staticmethod
    def warnings(metrics, text):
        """(id, text) of each warning; a program without ids has its lines on stderr."""
        found = []
        if metrics.exists():
            found = json.loads(metrics.read_text()).get("warnings")
            if found is not None:
                return [(w["id"], w["text"]) for w in found]
        return [("", line) for line in text.splitlines()
                if line.strip() and not line.startswith("lamina: ")]

    def twin(self, kind, variant, sim_of_both):
        """The unspoiled twin, once for each scene, format and settings of both."""
        base = kind.bases[variant]
        form = kind.twin_format or kind.formats[variant]
        key = (base, form, variant, str(sim_of_both), kind.prepare and kind.name)
        with self._lock:
            if key not in self._twins:
                data = self.simulate(base, sim_of_both, variant)
                recording = self.recording(data)
                if kind.prepare:
                    kind.prepare(recording)
                self._twins[key] = self.judge_twin(recording, data, base, form)
            return self._twins[key]

    def judge_twin(self, recording, data, base, form):
        folder = self.output / f"twin.{data.parent.name}.{form}"
        if recording.time_increment:
            folder = folder.with_name(folder.name + ".timed")
        done, warned = self.map(recording, form, folder)
        result = Result(folder.name, "twin", RIGHT, seconds=done.seconds, base=base)
        result.warnings = [w[0] or w[1] for w in warned]
        if done.hang or done.code:
            result.outcome = HANG if done.hang else BROKEN if done.code == 1 else POOR
            result.message = done.text.strip()
            return result
        camera = scenes.BASES[base][2]
        verdict = judge.judge(folder / "map", recording, self.truth(data, camera), camera, None)
        result.ate, result.ate_window, result.why = verdict.ate, verdict.ate_window, verdict.why
        if warned:
            result.outcome = ALARM
        return result

    def run(self, kind, variant):
        chance = random.Random(f"{self.seed} {kind.name} {variant}")
        base, form = kind.bases[variant], kind.formats[variant]
        both = kind.both(chance, variant) if kind.both else {}
        sim = {**both, **(kind.sim(chance, variant) if kind.sim else {})}
        twin = self.twin(kind, variant, both)
        data = self.simulate(base, sim, variant)
        recording = self.recording(data).copy()
        if kind.prepare:
            kind.prepare(recording)
        more = None
        if kind.more:
            settings = {**both, **kind.more(chance, variant)}
            more = self.recording(self.simulate(base, settings, variant))
        kind.spoil(recording, chance, variant, more)
        folder = self.output / f"{kind.name}.{variant}"
        done, warned = self.map(recording, form, folder)
        result = Result(folder.name, kind.group, SILENT, twin=twin.ate, seconds=done.seconds,
                        warnings=[w[0] or w[1] for w in warned], base=base)
        if done.hang:
            result.outcome = HANG
        elif done.code == 2:
            # The folder's name is the kind's: no word of the program's.
            result.message = (done.text.strip().splitlines() or [""])[-1].replace(
                str(folder) + "/", "")
            named = re.search(kind.words, result.message, re.I)
            result.outcome = SAID if named else POOR
        elif done.code:
            result.outcome = BROKEN
            result.message = done.text.strip()
        else:
            self._judge(result, folder, recording, data, kind, warned)
        self._tidy(folder)
        return result

    def _judge(self, result, folder, recording, data, kind, warned):
        camera = scenes.BASES[result.base][2]
        limit = result.twin if result.twin == result.twin else 0.0
        verdict = judge.judge(folder / "map", recording, self.truth(data, camera), camera, limit)
        result.ate, result.ate_window, result.why = verdict.ate, verdict.ate_window, verdict.why
        named = any(re.search(kind.ids, name, re.I) if name else
                    re.search(kind.words, text, re.I) for name, text in warned)
        lost = verdict.lost > LOST and not named
        if verdict.right and lost:
            result.why = f"{100 * verdict.lost:.0f} % of the poses left out, unsaid"
        if verdict.right and not lost:
            result.outcome = RIGHT
        elif named:
            result.outcome = SAID
        elif warned:
            result.outcome = POOR

    @staticmethod
    def _tidy(folder):
        """What a hand-check needs stays."""
        for name in ("session.lamina", "report.html", "planes.ply", "terrain.ply", "surfels.ply"):
            (folder / "map" / name).unlink(missing_ok=True)

    def twins(self):
        return list(self._twins.values())


