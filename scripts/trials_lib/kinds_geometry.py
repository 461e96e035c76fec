"""Units and geometry that files state wrongly, and the robot in its own images."""
import array
import copy
import math

from .kinds import kind

UNITS = r"wheel_scale|odometry_(scale|unit)"
OFFSET = r"depth_offset|stereo_(offset|shift)|disparity"
IN_VIEW = r"robot_in_view|static|own_body"


def repaint(pictures, new_pixels):
    for picture in pictures:
        pixels = picture.read()
        picture.pixels = new_pixels(pixels, picture.width, picture.height)


@kind("units", "odometry in millimetres, or in feet, beside a camera", ("room_camera", "room_both"), "folder", UNITS,
      r"odometry|wheel|unit|millimetre|feet")
def odometry_units(r, chance, variant, more):
    a = 1 / 0.3048 if variant else 1000
    for o in r.odometry:
        o.pose = [a * o.pose[0], a * o.pose[1], *o.pose[2:]]


@kind("units", "beams are in reversed order from somewhere on", "office_scan", ("folder", "log"),
      r"mirror|revers|beam_order", r"mirror|revers|order")
def beams_change(r, chance, variant, more):
    for s in r.scans[int(len(r.scans) * chance.uniform(0.3, 0.6)):]:
        s.ranges.reverse()


@kind("units", "ranges are 7 to 10 % too long or too short beside right wheels", ("office_scan", "room_both"), "folder",
      UNITS + r"|range_scale|ranges", r"ranges|wheel")
def ranges_scaled(r, chance, variant, more):
    k = 1 + chance.uniform(0.07, 0.1) * chance.choice((-1, 1))
    for s in r.scans:
        s.ranges = [k * x for x in s.ranges]


@kind("units", "the scanner's place is stated .5 to 1 m off", ("office_scan", "room_both"), "folder",
      r"lidar_(mounting|place|extrinsic)|mounting", r"lidar|place|T_body_lidar")
def scanner_place(r, chance, variant, more):
    pose, way = r.mounting("lidar", "T_body_lidar"), chance.uniform(-math.pi, math.pi)
    off = chance.uniform(0.5, 1)
    pose[0] += off * math.cos(way)
    pose[1] += off * math.sin(way)
    r.mount("lidar", "T_body_lidar", pose)


@kind("units", "right images are 1 to 3 px aside", "room_stereo", "folder", OFFSET, r"offset|disparit|shift")
def stereo_shifted(r, chance, variant, more):
    n = chance.choice((2, 3)) if variant else 1

    def shift(pixels, width, height):
        out = array.array("B")
        for v in range(height):
            row = pixels[v * width:(v + 1) * width]
            out += row[n:] + row[-n:]
        return out
    repaint(r.right, shift)


@kind("units", "a bar, or a board, of the robot's own in the image", "room_camera", "folder", IN_VIEW,
      r"robot|bar|static|lens")
def own_body(r, chance, variant, more):
    scale, z = r.number("depth_camera", "depth_scale"), chance.uniform(0.4, 0.7)
    top = chance.uniform(0.15, 0.3)

    def paint(pixels, width, height):
        out = array.array("H", pixels)
        rows = range(int(0.8 * height), height) if variant else range(int(top * height), int((top + 0.1) * height))
        columns = range(width // 5, 4 * width // 5) if variant else range(width)
        for v in rows:
            for u in columns:
                out[v * width + u] = round((z + chance.gauss(0, 0.002)) * scale)
        return out
    repaint(r.depth, paint)


@kind("units", "depths are distances along the ray", ("room_camera", "room_both"), "folder", r"along_ray|depth_ray",
      r"ray|optical axis")
def depth_along_ray(r, chance, variant, more):
    fx, fy, cx, cy = (r.number("depth_camera", key) for key in ("fx", "fy", "cx", "cy"))
    repaint(r.depth, lambda pixels, width, height: array.array("H", [
        min(65535, round(z * math.hypot(1, (i % width - cx) / fx, (i // width - cy) / fy)))
        for i, z in enumerate(pixels)]))


@kind("units", "the camera's quaternion is written w, x, y, z", ("room_camera", "room_both"), "folder",
      r"quaternion|camera_(?!clock)|mounting", r"quaternion|rotation|order")
def quaternion_order(r, chance, variant, more):
    pose = r.mounting("depth_camera", "T_body_camera")
    r.mount("depth_camera", "T_body_camera", [*pose[:3], pose[6], *pose[3:6]])


@kind("units", "every image is listed twice, with one stamp", "room_camera", "folder", r"clock|twice|stamp|repeat",
      r"twice|stamp")
def images_listed_twice(r, chance, variant, more):
    r.depth = [copy.deepcopy(picture) for picture in r.depth for _ in range(2)]
