"""A simulated recording in memory, to be spoiled, and its writers: dataset folder, CARMEN log, bag.

Every item keeps two times: `true`, when it was measured, and `stamp`, what the file will say.
Both are whole nanoseconds. Items stand in the order in which they are written.
"""
import array
import copy
import dataclasses
import math
import os
import pathlib

from . import bag, images

SECOND = 10**9


def ns_of(text):
    whole, _, part = text.partition(".")
    return int(whole) * SECOND + int((part + "0" * 9)[:9])


def text_of(ns):
    return f"{ns // SECOND}.{ns % SECOND:09d}"


def yaw_of(pose):
    x, y, z, w = pose[3:]
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def multiply(p, q):
    """Product of quaternions x y z w."""
    a, b, c, d = p
    e, f, g, h = q
    return (d * e + a * h + b * g - c * f, d * f - a * g + b * h + c * e,
            d * g + a * f - b * e + c * h, d * h - a * e - b * f - c * g)


def about(axis, angle):
    half = angle / 2
    return tuple(math.sin(half) * (i == axis) for i in range(3)) + (math.cos(half),)


@dataclasses.dataclass
class Scan:
    true: int
    stamp: int
    first: float
    step: float
    least: float
    most: float
    ranges: list
    frame: str = "laser"


@dataclasses.dataclass
class Pose:
    true: int
    stamp: int
    pose: list  # x y z qx qy qz qw
    child: str = "base_link"


@dataclasses.dataclass
class Picture:
    true: int
    stamp: int
    file: pathlib.Path
    pixels: array.array = None  # where they were changed

    def read(self):
        if self.pixels is None:
            self.width, self.height, self.pixels = images.read_png(self.file.read_bytes())
        return self.pixels


class Recording:
    """What `lamina simulate` wrote."""

    def __init__(self, folder, epoch):
        self.folder, self.shift = folder, epoch
        self.calibration = self._calibration(folder / "calibration.yaml")
        self.scans = [self._scan(line) for line in self._lines("scans.csv")]
        self.odometry = [Pose(t, t, p) for t, p in self._poses("odometry.txt")]
        self.truth = dict(self._poses("groundtruth.txt"))
        self.depth, self.left, self.right = (self._pictures(name) for name in
                                             ("depth.txt", "left.txt", "right.txt"))
        # What the writers may be told beside the measurements.
        self.log_stamps = None      # CARMEN: text of a stamp of (index of line, ns)
        self.log_head = []          # CARMEN: PARAM lines
        self.robotlaser = None      # CARMEN: accuracy; ROBOTLASER1 instead of FLASER
        self.log_lines = None       # CARMEN: changes the lines
        self.no_return = 81.83      # CARMEN: what stands for no return
        self.log_host = "robot"
        self.time_increment = 0.0   # bag
        self.info = None            # bag: width, height, (fx, fy, cx, cy)
        self.encoding = "16UC1"     # bag
        self.static = None          # bag: transforms (parent, child, pose)
        self.tf_odometry = []       # bag: further (parent, child, Pose list)
        self.scan_topics = {}       # bag: frame -> topic
        self.extra_calibration = None  # text of a file for --calibration
        self.map_options = []
        self.lines_of = {}          # folder: file -> function of its lines

    def _lines(self, name):
        path = self.folder / name
        text = path.read_text() if path.exists() else ""
        return [line for line in text.splitlines() if not line.startswith("#")]

    def _calibration(self, path):
        out = {}
        for line in path.read_text().splitlines():
            if line and line[0] not in "# ":
                section = out.setdefault(line.rstrip(":"), {})
            elif line.startswith("  "):
                key, _, value = line.strip().partition(": ")
                section[key] = value
        return out

    def _scan(self, line):
        f = line.split(",")
        t = ns_of(f[0]) + self.shift
        return Scan(t, t, *(float(x) for x in f[1:5]), [float(x) for x in f[5:]])

    def _poses(self, name):
        out = []
        for line in self._lines(name):
            f = line.split()
            out.append((ns_of(f[0]) + self.shift, [float(x) for x in f[1:8]]))
        return out

    def _pictures(self, name):
        out = []
        for line in self._lines(name):
            stamp, file = line.split()
            t = ns_of(stamp) + self.shift
            out.append(Picture(t, t, self.folder / file))
        return out

    def frames(self):
        """What gets a pose in trajectory.txt: (stamp, true) in order of measurement."""
        seen, out = set(), []
        for item in sorted(self.scans + self.depth + self.left, key=lambda i: i.true):
            if item.true in self.truth and (item.stamp, item.true) not in seen:
                seen.add((item.stamp, item.true))
                out.append((item.stamp, item.true))
        return out

    def copy(self):
        other = copy.copy(self)
        for name in ("calibration", "scans", "odometry", "depth", "left", "right"):
            setattr(other, name, copy.deepcopy(getattr(self, name)))
        for name in ("log_head", "tf_odometry", "scan_topics", "map_options", "lines_of"):
            setattr(other, name, copy.copy(getattr(self, name)))
        return other

    def pose_at(self, true):
        """Odometry at a time, linear between samples."""
        o = self.odometry
        low, high = 0, len(o) - 1
        if true <= o[0].true:
            return o[0].pose
        if true >= o[-1].true:
            return o[-1].pose
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if o[middle].true <= true else (low, middle)
        a, b = o[low], o[high]
        s = (true - a.true) / (b.true - a.true)
        turn = math.remainder(yaw_of(b.pose) - yaw_of(a.pose), 2 * math.pi)
        at = [p + s * (q - p) for p, q in zip(a.pose[:3], b.pose[:3])]
        return at + list(about(2, yaw_of(a.pose) + s * turn))

    def mounting(self, section, key):
        text = self.calibration[section][key]
        numbers = [float(x) for x in text.replace("[", " ").replace("]", " ").replace(",", " ")
                   .replace("{", " ").replace("}", " ").replace("translation:", " ")
                   .replace("rotation_xyzw:", " ").split()]
        return numbers

    def mount(self, section, key, pose):
        t, q = (", ".join(f"{x:.9g}" for x in part) for part in (pose[:3], pose[3:]))
        self.calibration[section][key] = f"{{translation: [{t}], rotation_xyzw: [{q}]}}"

    def turn_mounting(self, section, axis, angle):
        """Turns a sensor's stated place about an axis of the body."""
        key = "T_body_lidar" if section == "lidar" else "T_body_camera"
        pose = self.mounting(section, key)
        self.mount(section, key, pose[:3] + list(multiply(about(axis, angle), pose[3:])))

    def number(self, section, key):
        return float(self.calibration[section][key])

    # Writers.

    def write(self, kind, path):
        return {"folder": self.write_folder, "log": self.write_log,
                "bag": self.write_bag}[kind](path)

    def calibration_text(self):
        return "".join(f"{section}:\n" + "".join(f"  {k}: {v}\n" for k, v in keys.items())
                       for section, keys in self.calibration.items())

    def _write_lines(self, path, lines):
        lines = self.lines_of.get(path.name, lambda l: l)(lines)
        path.write_text("\n".join(lines) + "\n")

    def write_folder(self, path):
        path.mkdir(parents=True)
        (path / "calibration.yaml").write_text(self.calibration_text())
        if self.scans:
            self._write_lines(path / "scans.csv", [
                f"{text_of(s.stamp)},{s.first:.10g},{s.step:.10g},{s.least:g},{s.most:g}," +
                ",".join(f"{r:.4f}" if r > 0 else "0" for r in s.ranges) for s in self.scans])
        if self.odometry:
            self._write_lines(path / "odometry.txt", [
                text_of(o.stamp) + " " + " ".join(f"{x:.9f}" for x in o.pose)
                for o in self.odometry])
        for name in ("depth", "left", "right"):
            pictures = getattr(self, name)
            if not pictures:
                continue
            (path / name).mkdir()
            lines = []
            for i, picture in enumerate(pictures):
                file = path / name / f"{i:05d}.png"
                if picture.pixels is None:
                    os.link(picture.file, file)
                else:
                    file.write_bytes(images.write_png(picture.width, picture.height,
                                                      picture.pixels))
                lines.append(f"{text_of(picture.stamp)} {name}/{file.name}")
            self._write_lines(path / f"{name}.txt", lines)
        return path

    def _log_scan(self, s, stamp):
        robot = self.pose_at(s.true)
        x, y, yaw = robot[0], robot[1], yaw_of(robot)
        dx, dy = self.mounting("lidar", "T_body_lidar")[:2]
        turn = yaw_of(self.mounting("lidar", "T_body_lidar"))
        laser = (x + math.cos(yaw) * dx - math.sin(yaw) * dy,
                 y + math.sin(yaw) * dx + math.cos(yaw) * dy, yaw + turn)
        ranges = " ".join(f"{r:.3f}" if r > 0 else f"{self.no_return:.2f}" for r in s.ranges)
        poses = " ".join(f"{v:.6f}" for v in laser + (x, y, yaw))
        if self.robotlaser is None:
            return f"FLASER {len(s.ranges)} {ranges} {poses} {stamp}"
        field = s.step * (len(s.ranges) - 1)
        return (f"ROBOTLASER1 0 {s.first:.6f} {field:.6f} {s.step:.8f} {s.most:.2f} "
                f"{self.robotlaser:g} 0 {len(s.ranges)} {ranges} 0 {poses} 0 0 0.4 0.3 1e6 {stamp}")

    def write_log(self, path):
        path = path.with_suffix(".log")
        lines = list(self.log_head)
        # The order of writing is that of measuring.
        items = sorted(self.odometry + self.scans, key=lambda i: (i.true, isinstance(i, Scan)))
        for index, item in enumerate(items):
            if self.log_stamps:
                stamp = self.log_stamps(index, item.stamp)
            else:
                stamp = f"{item.stamp // SECOND}.{item.stamp % SECOND // 1000:06d}"
            stamp = f"{stamp} {self.log_host} {stamp}"  # sender's and logger's: one clock
            if isinstance(item, Scan):
                lines.append(self._log_scan(item, stamp))
            else:
                x, y, yaw = item.pose[0], item.pose[1], yaw_of(item.pose)
                lines.append(f"ODOM {x:.6f} {y:.6f} {yaw:.6f} 0 0 0 {stamp}")
        path.write_text("\n".join(self.log_lines(lines) if self.log_lines else lines) + "\n")
        return path

    def _static(self):
        if self.static is not None:
            return self.static
        out = []
        if self.scans:
            out.append(("base_link", "laser", self.mounting("lidar", "T_body_lidar")))
        if self.depth:
            out.append(("base_link", "camera", self.mounting("depth_camera", "T_body_camera")))
        return out

    def _messages(self):
        first = min(i.true for i in self.scans + self.odometry + self.depth)
        entries = [(first, parent, child, pose) for parent, child, pose in self._static()]
        if entries:
            yield first, "/tf_static", "tf2_msgs/TFMessage", bag.transforms(entries)
        for o in self.odometry:
            yield o.true, "/odom", "nav_msgs/Odometry", bag.odometry(o.stamp, "odom", o.child,
                                                                     o.pose)
        for parent, child, poses in self.tf_odometry:
            for o in poses:
                yield o.true, "/tf", "tf2_msgs/TFMessage", bag.transforms(
                    [(o.stamp, parent, child, o.pose)])
        for s in self.scans:
            yield (s.true, self.scan_topics.get(s.frame, "/scan"), "sensor_msgs/LaserScan",
                   bag.laser_scan(s.stamp, s.frame, s, self.time_increment))
        camera = self.calibration.get("depth_camera", {})
        k = tuple(float(camera[key]) for key in ("fx", "fy", "cx", "cy")) if camera else ()
        for picture in self.depth:
            pixels = picture.read()
            w, h = picture.width, picture.height
            scale = float(camera["depth_scale"])
            if self.encoding == "16UC1":
                data = array.array("H", [min(65535, round(1000 * p / scale)) for p in pixels])
            else:  # 32FC1: metres, or millimetres as metres
                unit = 1000 if self.encoding == "32FC1 mm" else 1
                data = array.array("f", [unit * p / scale if p else math.nan for p in pixels])
            info = self.info or (w, h, k)
            yield (picture.true, "/camera/depth/camera_info", "sensor_msgs/CameraInfo",
                   bag.camera_info(picture.stamp, "camera", *info))
            yield (picture.true, "/camera/depth/image_raw", "sensor_msgs/Image",
                   bag.image(picture.stamp, "camera", w, h, self.encoding.split()[0],
                             data.tobytes()))

    def write_bag(self, path):
        path = path.with_suffix(".bag")
        bag.write_bag(path, sorted(self._messages(), key=lambda m: m[0]))
        return path
