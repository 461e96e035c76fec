"""Reads an output folder of `lamina map` and judges it against a simulated world's truth, by yaw and
translation alone: a mirror image or a tilted map must not pass. Python's standard library alone."""
import bisect
import json
import math
import pathlib
import re


def poses(file):
    """[(stamp, x, y, z)] of a TUM file of poses."""
    rows = (line.split() for line in pathlib.Path(file).read_text().splitlines()
            if line.strip() and not line.startswith("#"))
    return [tuple(map(float, row[:4])) for row in rows]


def at(track, stamp):
    """The position at a stamp, interpolated; None outside the track."""
    i = bisect.bisect_left(track, (stamp,))
    if i < len(track) and abs(track[i][0] - stamp) < 1e-6:
        return track[i][1:]
    if i == 0 or i == len(track):
        return None
    (t0, *p0), (t1, *p1) = track[i - 1], track[i]
    share = (stamp - t0) / (t1 - t0)
    return tuple(a + share * (b - a) for a, b in zip(p0, p1))


class Alignment:
    """Of pairs (p, q): q ~ R(yaw) p + t, least squares."""

    def __init__(self, pairs):
        n = len(pairs)
        self.p = [sum(p[i] for p, _ in pairs) / n for i in range(3)]
        self.q = [sum(q[i] for _, q in pairs) / n for i in range(3)]
        c = s = 0
        for p, q in pairs:
            a, b = (p[0] - self.p[0], p[1] - self.p[1]), (q[0] - self.q[0], q[1] - self.q[1])
            c += a[0] * b[0] + a[1] * b[1]
            s += a[0] * b[1] - a[1] * b[0]
        self.yaw = math.atan2(s, c)

    def __call__(self, p):
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y = p[0] - self.p[0], p[1] - self.p[1]
        z = (p[2] if len(p) > 2 else self.p[2]) - self.p[2]
        return (c * x - s * y + self.q[0], s * x + c * y + self.q[1], z + self.q[2])


class Result:
    """What a run left: files, warnings, and its place in the truth's frame."""

    def __init__(self, folder, truth=None):
        self.folder = pathlib.Path(folder)
        metrics = self.folder / "metrics.json"
        self.metrics = json.loads(metrics.read_text()) if metrics.exists() else {}
        self.warnings = self.metrics.get("warnings", [])
        self.truth = pathlib.Path(truth) if truth else None
        self.ate = math.nan
        path = self.folder / "trajectory.txt"
        if self.truth and path.exists():
            self.trajectory = poses(path)
            track = poses(self.truth / "groundtruth.txt")
            pairs = [(p[1:], q) for p in self.trajectory if (q := at(track, p[0]))]
            if pairs:
                self.align = Alignment(pairs)
                self.ate = math.sqrt(
                    sum(math.dist(self.align(p), q) ** 2 for p, q in pairs) / len(pairs))

    def way(self):
        """Length of the path, m."""
        path = poses(self.folder / "trajectory.txt")
        return sum(math.dist(a[1:], b[1:]) for a, b in zip(path, path[1:]))

    def said(self, pattern):
        return any(re.search(pattern, w["id"] + ": " + w["text"], re.I) for w in self.warnings)

    def planes(self):
        return json.loads((self.folder / "planes.json").read_text())["planes"]

    def cells(self):
        """[(x, y, value)] of occupancy.pgm in the truth's frame."""
        yaml = (self.folder / "occupancy.yaml").read_text()
        step = float(re.search(r"resolution: *(\S+)", yaml)[1])
        ox, oy = map(float, re.search(r"origin: *\[([^,]+),([^,]+)", yaml).groups())
        data = (self.folder / "occupancy.pgm").read_bytes()
        head = re.match(rb"P5\s(?:#.*\s)*(\d+)\s+(\d+)\s+(\d+)\s", data)
        width, height = int(head[1]), int(head[2])
        pixels = data[head.end():]
        for row in range(height):
            y = oy + (height - 1 - row + 0.5) * step
            for col in range(width):
                value = pixels[row * width + col]
                if value != 205:
                    yield (*self.align((ox + (col + 0.5) * step, y))[:2], value)

    def occupied_off(self, most=0.2):
        """Share of the occupied cells that lie further than `most` m from every true surface."""
        edges = true_edges(self.truth)
        cells = [(x, y) for x, y, value in self.cells() if value < 50]
        return sum(distance(c, edges, most) > most for c in cells) / max(1, len(cells))


def true_edges(truth):
    """Segments, in plan, of the outlines of all that stands up from the floor."""
    edges = []
    walls = truth / "walls.yaml"
    if walls.exists():  # corners one number a line
        for block in walls.read_text().split("outline:")[1:]:
            corners = re.findall(r"- - (\S+)\s+- (\S+)\s+- \S+", block)
            points = [(float(x), float(y)) for x, y in corners]
            edges += list(zip(points, points[1:] + points[:1]))
        return edges
    for line in re.sub(r",\n\s+", ", ", (truth / "truth.yaml").read_text()).splitlines():
        normal = re.search(r"normal: \[([^\]]+)\]", line)
        outline = re.search(r"outline: (\[\[.*?\]\])", line)
        if not normal or not outline:
            continue
        points = json.loads(outline[1])
        if abs(float(normal[1].split(",")[2])) > 0.9 and max(p[2] for p in points) < 0.02:
            continue
        edges += [(a[:2], b[:2]) for a, b in zip(points, points[1:] + points[:1])]
    return edges


def distance(point, edges, enough):
    best = math.inf
    for (ax, ay), (bx, by) in edges:
        dx, dy = bx - ax, by - ay
        length = dx * dx + dy * dy
        t = ((point[0] - ax) * dx + (point[1] - ay) * dy) / length if length > 0 else 0
        t = min(1, max(0, t))
        best = min(best, math.hypot(ax + t * dx - point[0], ay + t * dy - point[1]))
        if best <= enough:
            break
    return best
