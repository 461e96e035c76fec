"""Is a map right? Its path and its grids against the truth, moved by yaw and translation alone.

A mirrored map stays mirrored under such a move, so it cannot pass. Nothing here uses a 3D
alignment.
"""
import bisect
import dataclasses
import math
import re

from . import images
from .recording import ns_of

NEAR = 0.20           # m from a true wall or obstacle within which an occupied cell is right
TOPS = 0.60           # m into an obstacle that its top may be seen by a camera
EDGE = 3              # cells that free ground may reach beyond the true free ground
SHARE = 0.05          # of occupied or free cells that may be wrong
MARGIN = 15           # cells that the truth's grid is widened by
LEAST = 20            # wrong cells that are no accident
FREE, BLOCKED = 0.8, 0.0   # navigability from and up to which ground counts as free, blocked
KEPT = 0.5            # share of the frames and scans that must have a pose, said or not


@dataclasses.dataclass
class Verdict:
    right: bool
    ate: float = math.nan       # m, refined path
    ate_window: float = math.nan  # m, the path before the refinement
    lost: float = 0.0           # share of frames and scans without a pose
    why: str = ""
    shares: tuple = ()          # wrong shares: occupied, free, blocked ground, free ground


def read_path(file):
    out = []
    for line in file.read_text().splitlines():
        if line and line[0] != "#":
            f = line.split()
            out.append((ns_of(f[0]), tuple(float(x) for x in f[1:4])))
    return out


def pair(path, frames):
    """Pairs (position, true time): by stamp where the recorded stamps increase, else by order."""
    stamps = [stamp for stamp, _ in frames]
    if all(a < b for a, b in zip(stamps, stamps[1:])):
        out = []
        for stamp, position in path:
            at = bisect.bisect_left(stamps, stamp - 1000)
            if at < len(stamps) and abs(stamps[at] - stamp) <= 1000:
                out.append((position, frames[at][1]))
        if len(out) >= KEPT * len(path):
            return out, True
    if len(path) == len(frames):
        return [(p, true) for (_, p), (_, true) in zip(path, frames)], False
    # Some were left out: each pose to the next frame in order whose stamp is nearest.
    out, at, slack = [], 0, max(0, len(frames) - len(path))
    for k, (stamp, position) in enumerate(path):
        window = range(at, min(len(frames), at + slack + 1))
        if not window:
            break
        best = min(window, key=lambda i: (abs(stamps[i] - stamp), i))
        if abs(stamps[best] - stamp) > 10**6:  # stamps of its own
            best = min(len(frames) - 1, round(k * (len(frames) - 1) / max(1, len(path) - 1)))
        out.append((position, frames[best][1]))
        slack -= max(0, best - at)
        at = best + 1
    return out, False


def align(pairs, truth):
    """Yaw and translation that bring the map's positions to the true ones; rms of what is left."""
    a = [p for p, _ in pairs]
    b = [truth[t][:3] for _, t in pairs]
    n = len(a)
    ma = [sum(p[i] for p in a) / n for i in range(3)]
    mb = [sum(p[i] for p in b) / n for i in range(3)]
    dot = cross = 0.0
    for p, q in zip(a, b):
        px, py, qx, qy = p[0] - ma[0], p[1] - ma[1], q[0] - mb[0], q[1] - mb[1]
        dot += px * qx + py * qy
        cross += px * qy - py * qx
    yaw = math.atan2(cross, dot)
    c, s = math.cos(yaw), math.sin(yaw)
    move = (c, s, mb[0] - c * ma[0] + s * ma[1], mb[1] - s * ma[0] - c * ma[1], mb[2] - ma[2])
    total = 0.0
    for p, q in zip(a, b):
        x, y = apply(move, p[0], p[1])
        total += (x - q[0])**2 + (y - q[1])**2 + (p[2] + move[4] - q[2])**2
    return move, math.sqrt(total / n)


def apply(move, x, y):
    c, s, dx, dy, _ = move
    return c * x - s * y + dx, s * x + c * y + dy


def numbers_of(file, keys):
    """Top-level `key: value` lines, and `[a, b, c]` as lists."""
    out = {}
    for line in file.read_text().splitlines():
        key, _, value = line.partition(":")
        if key in keys:
            fields = value.replace("[", " ").replace("]", " ").replace(",", " ").split()
            out[key] = [float(f) for f in fields]
    return out


class TruthGrid:
    """True free ground: where the robot gets to from its start, by the simulator's reckoning."""

    def __init__(self, folder, camera):
        self.resolution, self.x0, self.y0 = self._geometry(folder / "truth.yaml")
        self.width, self.height, reachable = images.read_pfm(folder / "truth_reachable.pfm")
        reachable = self._padded(reachable)
        w, h = self.width, self.height
        free = [v > 0 for v in reachable]
        border = [k for k in range(w * h) if not free[k] and self._touches(free, k)]
        cells = [(k % w, k // w) for k in range(w * h) if free[k]]
        self.free = self._grown([k for k in range(w * h) if free[k]], EDGE)
        self.inner = [a and not b for a, b in zip(free, self._grown(border, 5))]
        self.obstacle = self._disc(border, NEAR)
        if camera and cells:
            low = [min(c[i] for c in cells) - 4 for i in range(2)]
            high = [max(c[i] for c in cells) + 4 for i in range(2)]
            for k in self._members(self._disc(border, TOPS)):
                i, j = k % w, k // w
                if not free[k] and low[0] <= i <= high[0] and low[1] <= j <= high[1]:
                    self.obstacle[k] = True

    def _padded(self, values, n=MARGIN):
        """The truth ends at the outermost wall; what lies just beyond is no error."""
        w, out = self.width, [0.0] * (n * (self.width + 2 * n))
        for j in range(self.height):
            out += [0.0] * n + list(values[j * w:(j + 1) * w]) + [0.0] * n
        out += [0.0] * (n * (w + 2 * n))
        self.width, self.height = w + 2 * n, self.height + 2 * n
        self.x0, self.y0 = self.x0 - n * self.resolution, self.y0 - n * self.resolution
        return out

    @staticmethod
    def _geometry(file):
        number = r"([-+0-9.e]+)"
        found = re.search(rf"^grid: {{resolution: {number}, origin: \[{number}, {number}",
                          file.read_text(), re.M)
        return tuple(float(f) for f in found.groups())

    @staticmethod
    def _members(flags):
        return [k for k, flag in enumerate(flags) if flag]

    def _touches(self, free, k):
        w, i, j = self.width, k % self.width, k // self.width
        return ((i > 0 and free[k - 1]) or (i + 1 < w and free[k + 1]) or
                (j > 0 and free[k - w]) or (j + 1 < self.height and free[k + w]))

    def _stamp(self, cells, offsets):
        w, h, out = self.width, self.height, [False] * (self.width * self.height)
        for k in cells:
            i, j = k % w, k // w
            for di, dj in offsets:
                if 0 <= i + di < w and 0 <= j + dj < h:
                    out[(j + dj) * w + i + di] = True
        return out

    def _grown(self, cells, n):
        members = cells
        for step in [(1, 0)] * n + [(0, 1)] * n:  # one axis after the other: cheap
            dx, dy = step
            flags = self._stamp(members, ((0, 0), (dx, dy), (-dx, -dy)))
            members = self._members(flags)
        return flags

    def _disc(self, cells, radius):
        r = radius / self.resolution
        n = int(r + 1)
        offsets = [(i, j) for i in range(-n, n + 1) for j in range(-n, n + 1)
                   if i * i + j * j <= r * r]
        return self._stamp(cells, offsets)

    def at(self, flags, x, y):
        i = math.floor((x - self.x0) / self.resolution)
        j = math.floor((y - self.y0) / self.resolution)
        return 0 <= i < self.width and 0 <= j < self.height and flags[j * self.width + i]


def occupancy_cells(folder):
    """(x, y) of occupied and of free cells of occupancy.pgm."""
    about = numbers_of(folder / "occupancy.yaml", ("resolution", "origin"))
    r, (x0, y0, _) = about["resolution"][0], about["origin"]
    w, h, pixels = images.read_pgm(folder / "occupancy.pgm")
    cells = {0: [], 254: []}
    for k, value in enumerate(pixels[:w * h]):
        if value in cells:
            cells[value].append((x0 + (k % w + 0.5) * r, y0 + (h - 1 - k // w + 0.5) * r))
    return cells[0], cells[254]


def ground_cells(folder):
    """(x, y) of blocked and of free cells of the navigability grid."""
    about = numbers_of(folder / "grid" / "grid.yaml", ("resolution", "origin"))
    r, (x0, y0, _) = about["resolution"][0], about["origin"]
    w, h, values = images.read_tiff(folder / "grid" / "navigability.tiff")
    blocked, free = [], []
    for k, value in enumerate(values):
        if value >= FREE or value <= BLOCKED:
            (free if value >= FREE else blocked).append(
                (x0 + (k % w + 0.5) * r, y0 + (h - 1 - k // w + 0.5) * r))
    return blocked, free


def grid_errors(folder, move, truth, camera):
    """Name, wrong cells and share of them, of the kinds of cells."""
    out = []
    occupied, free = occupancy_cells(folder)
    blocked, ground = ground_cells(folder) if camera else ([], [])
    for name, cells, flags, good in (("occupied", occupied, truth.obstacle, True),
                                     ("free", free, truth.free, True),
                                     ("blocked ground", blocked, truth.inner, False),
                                     ("free ground", ground, truth.free, True)):
        wrong = sum(truth.at(flags, *apply(move, *cell)) != good for cell in cells)
        of = len(cells) + (len(ground) if name == "blocked ground" else 0)
        out.append((name, wrong, wrong / of if of else 0.0))
    return out


def judge(folder, recording, truth_grid, camera, twin):
    """The verdict on one map; twin: the ATE of its unspoiled twin, None for a twin itself."""
    path = read_path(folder / "trajectory.txt")
    frames = recording.frames()
    pairs, by_stamp = pair(path, frames)
    if len(pairs) < 3:
        return Verdict(False, why=f"{len(path)} poses of {len(frames)}")
    move, ate = align(pairs, recording.truth)
    verdict = Verdict(True, ate, lost=1 - min(1.0, len(path) / len(frames)))
    before = folder / "trajectory_before.txt"
    if before.exists():
        verdict.ate_window = align(pair(read_path(before), frames)[0], recording.truth)[1]
    stamps = [stamp for stamp, _ in frames]
    increasing = all(a < b for a, b in zip(stamps, stamps[1:]))
    limit = 0.05 if twin is None else 0.05 + 2 * twin
    reasons = []
    if ate > limit:
        reasons.append(f"ATE {ate:.3f} m")
    if len(path) < KEPT * len(frames):
        reasons.append(f"{len(path)} poses of {len(frames)}")
    elif increasing and not by_stamp:
        reasons.append("stamps changed")
    if truth_grid:
        errors = grid_errors(folder, move, truth_grid, camera)
        verdict.shares = tuple(share for _, _, share in errors)
        reasons += [f"{100 * share:.0f} % of {name} cells" for name, wrong, share in errors
                    if share > SHARE and wrong >= LEAST]
    verdict.right, verdict.why = not reasons, ", ".join(reasons)
    return verdict
