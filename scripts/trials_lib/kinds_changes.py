"""Faults that begin on the way, things aboard that sensors see, and files in another order."""
import array
import math

from .kinds import kind
from .kinds_geometry import repaint
from .kinds_motion import WHEELS
from .recording import multiply

CHANGED = r"chang|knock"
CAMERA_MOVED = r"camera_(moved|knocked|mounting|chang)|" + CHANGED
STUCK = r"repeat|frozen|stuck|stands_still"
ABOARD = r"aboard|robot_in_view|own_body|static|scans_contradicted"
AXES = r"axes|quaternion|frame|odometry_(?!never)|" + WHEELS


def later_half(items, chance):
    return items[int(len(items) * chance.uniform(0.4, 0.6)):]


@kind("changes", "the camera is knocked by 4 to 7 degrees on the way", ("room_camera", "room_both"),
      "folder", CAMERA_MOVED, r"camera.*(moved|knock|chang)",
      more=lambda c, v: {"camera.pitch_deg": (25 + 10 * v) + c.choice((-1, 1)) * c.uniform(4, 7)},
      both=lambda c, v: {"camera.pitch_deg": 25 + 10 * v})
def camera_knocked(r, chance, variant, more):
    at = int(len(r.depth) * chance.uniform(0.4, 0.6))
    r.depth = r.depth[:at] + more.depth[at:]


@kind("changes", "the unit of depth images changes on the way", ("room_camera", "room_both"),
      "folder", r"depth_(scale|unit)|" + CHANGED, r"depth.*(scale|unit)|chang")
def depth_unit_changes(r, chance, variant, more):
    k = 5 if variant else chance.uniform(1.15, 1.3)
    repaint(later_half(r.depth, chance), lambda pixels, width, height: array.array(
        "H", [min(65535, round(z / k)) for z in pixels]))


@kind("changes", "ranges become 7 to 12 % longer or shorter on the way", ("office_scan", "room_both"),
      "folder", r"range_scale|ranges|" + CHANGED + "|" + WHEELS, r"ranges|chang")
def ranges_change(r, chance, variant, more):
    k = 1 + chance.uniform(0.07, 0.12) * chance.choice((-1, 1))
    for s in later_half(r.scans, chance):
        s.ranges = [k * x for x in s.ranges]


def freeze(items, chance, content):
    """A fifth to a third of the items, one after the other, all have the content of the first."""
    start = int(len(items) * chance.uniform(0.3, 0.5))
    count = int(len(items) * chance.uniform(0.2, 0.33))
    for item in items[start + 1:start + count]:
        content(item, items[start])


@kind("changes", "images freeze for a while", ("room_camera", "room_both"), "folder", STUCK,
      r"same|repeat|froz")
def images_freeze(r, chance, variant, more):
    def content(picture, first):
        picture.file, picture.pixels = first.file, None
    freeze(r.depth, chance, content)


@kind("changes", "scans freeze for a while", ("office_scan", "room_both"), ("log", "folder"), STUCK,
      r"same|repeat|froz")
def scans_freeze(r, chance, variant, more):
    def content(scan, first):
        scan.ranges = list(first.ranges)
    freeze(r.scans, chance, content)


@kind("changes", "a part of every image is black from somewhere on", ("room_camera", "room_both"),
      "folder", r"covered|black|lost_part|" + CHANGED, r"part|black|cover")
def images_black_in_part(r, chance, variant, more):
    share = chance.uniform(0.4, 0.6)

    def paint(pixels, width, height):
        out = array.array("H", pixels)
        for v in range(height):
            for u in range(width):
                if (u < share * width) if variant else (v > (1 - share) * height):
                    out[v * width + u] = 0
        return out
    repaint(later_half(r.depth, chance), paint)


def paint_scan(s, middle, width, distance, noise):
    for i in range(len(s.ranges)):
        if abs(math.remainder(s.first + i * s.step - middle, 2 * math.pi)) < width / 2:
            s.ranges[i] = max(s.least, distance + noise())


@kind("aboard", "posts of the robot stand before the scanner", ("office_scan", "room_both"), "folder",
      ABOARD, r"aboard|robot")
def posts_aboard(r, chance, variant, more):
    posts = [(chance.uniform(-1.4, 1.4), math.radians(chance.uniform(4, 10)), chance.uniform(0.2, 0.5))
             for _ in range(3)]
    for s in r.scans:
        for angle, width, distance in posts:
            paint_scan(s, angle, width, distance, lambda: chance.gauss(0, 0.004))


@kind("aboard", "a board or a box on the robot hides a part of the scans",
      ("room_both", "office_scan"), ("folder", "log"), ABOARD, r"aboard|robot")
def board_aboard(r, chance, variant, more):
    angle, width = chance.uniform(-1, 1), math.radians(chance.uniform(30, 60))
    distance = chance.uniform(0.4, 0.9)
    for s in r.scans:
        paint_scan(s, angle, width, distance, lambda: chance.gauss(0, 0.005))


@kind("aboard", "a cart is pushed ahead from somewhere on", ("office_scan", "room_both"), "folder",
      ABOARD, r"aboard|robot")
def cart_from_somewhere_on(r, chance, variant, more):
    width, distance = math.radians(chance.uniform(30, 60)), chance.uniform(0.5, 0.9)
    for s in later_half(r.scans, chance):
        paint_scan(s, 0, width, distance, lambda: chance.gauss(0, 0.01))


@kind("order", "lines stand in any order, their stamps are right", ("office_scan", "room_both"),
      "folder", r"clock|order|stamp", r"order|stamp")
def lines_shuffled(r, chance, variant, more):
    for items in (r.scans, r.odometry, r.depth):
        if variant:
            items.reverse()
        else:
            chance.shuffle(items)


@kind("order", "x and y of the odometry are swapped", ("room_camera", "office_scan"), "folder", AXES,
      r"x and y|axes|odometry|mirror")
def odometry_swapped(r, chance, variant, more):
    for o in r.odometry:
        o.pose[0], o.pose[1] = o.pose[1], o.pose[0]


@kind("order", "the odometry's quaternions are written w, x, y, z", ("room_camera", "office_scan"),
      "folder", AXES, r"quaternion|order|odometry")
def odometry_quaternion(r, chance, variant, more):
    for o in r.odometry:
        o.pose = [*o.pose[:3], o.pose[6], *o.pose[3:6]]


@kind("order", "the odometry is that of the camera's optical frame", ("room_camera", "room_both"),
      "folder", AXES, r"optical|camera|odometry")
def odometry_of_camera(r, chance, variant, more):
    mount = r.mounting("depth_camera", "T_body_camera")
    for o in r.odometry:
        q, t = o.pose[3:], mount[:3]
        rotated = multiply(multiply(q, (*t, 0)), (-q[0], -q[1], -q[2], q[3]))
        o.pose = [p + d for p, d in zip(o.pose[:3], rotated)] + list(multiply(q, mount[3:]))


@kind("order", "images upside down and the height stated otherwise", "room_camera", "folder",
      r"upside|turned|camera_|floor_", r"upside|camera|height")
def upside_down_and_height(r, chance, variant, more):
    pose = r.mounting("depth_camera", "T_body_camera")
    pose[2] *= chance.uniform(1.3, 1.7)
    r.mount("depth_camera", "T_body_camera", pose)
    for picture in r.depth:
        picture.read().reverse()


@kind("order", "a camera that measures up to 2 m alone", ("room_camera", "room_both"), "folder",
      r"by_wheels_alone", r"wheels alone")
def short_sighted(r, chance, variant, more):
    most = chance.uniform(1.8, 2.2) * r.number("depth_camera", "depth_scale")
    repaint(r.depth, lambda pixels, width, height: array.array(
        "H", [z if z < most else 0 for z in pixels]))
