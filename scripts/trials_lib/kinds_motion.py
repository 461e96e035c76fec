"""Wheels, self-calibration, planar odometry, and scanners that do not sit as stated."""
import math

from .kinds import kind, remake_odometry
from .recording import SECOND, Pose, about, multiply

WHEELS = r"wheel_|wheels_(?!alone)|odometry_(?!never_meets)"
WHEEL_WORDS = r"wheel|odometry"
MOUNT = r"lidar_(yaw|turn|backward|sideway|mount|upside|heading)|scanner_|extrinsic|mounting"
MOUNT_WORDS = r"(lidar|scanner|scans?).*(turn|mirror|backward|sideway|upside|mount|yaw|sit)"
SLIP = WHEELS + r"|slip"


def scale_of(chance, variant, near, far):
    k = chance.uniform(near, far)
    return 1 + k if variant else 1 - k


@kind("self-calibration", "wheels count 15 to 25 % wrong beside a scanner", "office_scan",
      ("folder", "bag"), WHEELS, WHEEL_WORDS)
def wheel_scale(r, chance, variant, more):
    k = scale_of(chance, variant, 0.15, 0.25)
    remake_odometry(r, lambda a, l, t, i: (k * a, k * l, t))


@kind("self-calibration", "wheels count 15 to 25 % wrong beside a camera", "room_camera", "folder",
      WHEELS, WHEEL_WORDS)
def wheel_scale_camera(r, chance, variant, more):
    k = scale_of(chance, variant, 0.15, 0.25)
    remake_odometry(r, lambda a, l, t, i: (k * a, k * l, t))


@kind("self-calibration", "wheels turn 15 to 25 % too much or too little", "office_scan",
      ("folder", "log"), WHEELS, WHEEL_WORDS)
def wheel_turns(r, chance, variant, more):
    k = scale_of(chance, variant, 0.15, 0.25)
    remake_odometry(r, lambda a, l, t, i: (a, l, k * t))


@kind("self-calibration", "wheels drift by 3 to 6 degrees a metre",
      ("office_scan", "room_camera"), "folder", WHEELS, WHEEL_WORDS)
def wheel_drift(r, chance, variant, more):
    k = math.radians(scale_of(chance, variant, 0, 0) * chance.uniform(3, 6))
    remake_odometry(r, lambda a, l, t, i: (a, l, t + k * abs(a)))


@kind("self-calibration", "a wheel slips by 30 degrees three times", ("office_scan", "room_both"),
      "folder", SLIP, WHEEL_WORDS + r"|slip")
def wheel_slips(r, chance, variant, more):
    at = {len(r.odometry) * k // 4 + chance.randrange(20): chance.choice([-1, 1]) *
          math.radians(chance.uniform(20, 35)) for k in (1, 2, 3)}
    remake_odometry(r, lambda a, l, t, i: (a, l, t + at.get(i, 0)))


@kind("self-calibration", "stamps of wheels that jitter by 50 ms, headings that leap",
      "office_scan", ("log", "folder"), SLIP + r"|clock|stamp|jitter",
      WHEEL_WORDS + r"|stamp|clock|leap")
def wheels_jitter_and_leap(r, chance, variant, more):
    leaps = {chance.randrange(len(r.odometry)): math.radians(chance.uniform(-12, 12))
             for _ in range(12)}
    remake_odometry(r, lambda a, l, t, i: (a, l, t + leaps.get(i, 0)))
    for o in r.odometry:
        o.stamp += int(chance.gauss(0, 0.05) * SECOND)
    if not variant:  # a log's clock does not step back
        stamps = sorted(o.stamp for o in r.odometry)
        for o, stamp in zip(r.odometry, stamps):
            o.stamp = stamp


@kind("self-calibration", "wheels that stand still all along", ("office_scan", "room_camera"),
      "folder", WHEELS, WHEEL_WORDS)
def wheels_dead(r, chance, variant, more):
    for o in r.odometry:
        o.pose = list(r.odometry[0].pose)


@kind("self-calibration", "a scanner's heading stated 4 to 8 degrees wrong", "office_scan",
      ("folder", "bag"), MOUNT, MOUNT_WORDS)
def lidar_yaw_off(r, chance, variant, more):
    r.turn_mounting("lidar", 2, math.radians(chance.choice([-1, 1]) * chance.uniform(4, 8)))


@kind("self-calibration", "a camera's heading stated 4 to 8 degrees wrong",
      ("room_both", "room_camera"), "folder", r"camera_(yaw|heading|turn|mount|extrin)|extrinsic|mounting",
      r"camera.*(turn|mount|yaw)")
def camera_yaw_off(r, chance, variant, more):
    r.turn_mounting("depth_camera", 2, math.radians(chance.choice([-1, 1]) * chance.uniform(4, 8)))


@kind("self-calibration", "swells of 1 to 2 cm over 1 to 3 m of floor", "hall_camera", "folder",
      r"floor_(?!unseen)|swell|uneven|ground|body_pitch|focal", r"floor|swell|uneven|tilt",
      sim=lambda c, v: {"hall.swell_m": c.uniform(0.01, 0.02), "hall.swell_length": c.uniform(1, 3)})
def floor_swells(r, chance, variant, more):
    pass


@kind("self-calibration", "a scan takes 0.15 to 0.2 s, unsaid, in turns of 100 to 200 deg/s",
      "office_scan", "folder", r"sweep|scan_duration|scan_time|deskew|fast_turn|time_increment",
      r"sweep|duration|takes", both=lambda c, v: {"path.turn_rate": c.uniform(1.8, 3.4)},
      sim=lambda c, v: {"lidar.sweep_s": c.uniform(0.15, 0.2)})
def sweep_unsaid(r, chance, variant, more):
    pass


@kind("self-calibration", "depth images that bend by 1 to 1.5 px of disparity", "room_camera",
      "folder", r"depth_(noise|bend|distort)|bend|distortion|lens", r"bend|distort|noisy|depth",
      sim=lambda c, v: {"effects.distortion_sigma_px": c.uniform(0.8, 1.2)})
def images_bend(r, chance, variant, more):
    pass


@kind("scanner", "the beams' order is reversed", "office_scan", ("folder", "bag"),
      r"mirror|revers|beam_order|upside", r"mirror|revers|upside|against the wheels")
def mirrored(r, chance, variant, more):
    for s in r.scans:
        s.ranges.reverse()


@kind("scanner", "the scanner looks backwards, stated ahead", "office_scan", ("folder", "log"),
      MOUNT, MOUNT_WORDS)
def backwards(r, chance, variant, more):
    r.turn_mounting("lidar", 2, math.pi + chance.uniform(-0.02, 0.02))


@kind("scanner", "the scanner looks sideways, stated ahead", "office_scan", ("folder", "bag"),
      MOUNT, MOUNT_WORDS)
def sideways(r, chance, variant, more):
    r.turn_mounting("lidar", 2, chance.choice([-1, 1]) * math.pi / 2)


@kind("scanner", "the scanner hangs upside down, unsaid", ("office_scan", "room_scan"), "folder",
      r"mirror|revers|beam_order|upside", r"mirror|revers|upside|against the wheels",
      sim=lambda c, v: {"lidar.roll_deg": 180})
def lidar_upside_down(r, chance, variant, more):
    pose = r.mounting("lidar", "T_body_lidar")
    r.mount("lidar", "T_body_lidar", pose[:3] + [0, 0, 0, 1])


@kind("scanner", "the scanner is half a degree to a degree askew", "corridor_scan", "folder",
      MOUNT, MOUNT_WORDS)
def askew(r, chance, variant, more):
    r.turn_mounting("lidar", 2, math.radians(chance.choice([-1, 1]) * chance.uniform(0.5, 1)))


@kind("scanner", "the robot tips for two scans: they fit nowhere", "office_scan",
      ("folder", "log"), r"tip|outlier|slip|tracking_lost", r"tip|fit|slip|lost")
def tips(r, chance, variant, more):
    for k in (1, 2, 3):
        at = len(r.scans) * k // 4 + chance.randrange(5)
        shift = chance.choice([-1, 1]) * round(math.radians(chance.uniform(30, 45)) /
                                               abs(r.scans[0].step))
        for s in r.scans[at:at + 2]:
            s.ranges = s.ranges[shift:] + s.ranges[:shift]
            s.ranges = [min(x, 3.5) if x > 0 else x for x in s.ranges]


@kind("scanner", "scans alone, five a second, on a robot that turns 15 to 24 degrees between them",
      "office_alone", ("folder", "bag"), r"fast|turn|tracking_lost|rate|motion_unknown|scan_gap",
      r"lost|turn|fast|motion|tracking", both=lambda c, v: {"lidar.fov_deg": 200 + 40 * v,
                                                            "lidar.beams": 181},
      sim=lambda c, v: {"path.turn_rate": c.uniform(1.3, 2.1)})
def fast_turns_alone(r, chance, variant, more):
    pass


@kind("scanner", "a scanner that rocks by 2 to 5 degrees and meets the ground", "hall_scan",
      "folder", r"rock|tilt|ground|lean|level|uneven|body_pitch", r"rock|tilt|ground|lean|level",
      sim=lambda c, v: {"hall.sway_roll_deg": c.uniform(2, 5),
                        "hall.sway_pitch_deg": c.uniform(2, 5),
                        "hall.sway_period_s": c.uniform(1, 2)})
def rocking(r, chance, variant, more):
    pass


@kind("scanner", "wheels whose left and right are swapped", "office_scan", ("folder", "log"),
      r"mirror|revers|" + WHEELS, r"mirror|revers|wheel|turn")
def wheels_mirrored(r, chance, variant, more):
    remake_odometry(r, lambda a, l, t, i: (a, -l, -t))


@kind("scanner", "the odometry restarts at zero", ("room_camera", "office_scan"), "folder",
      r"odometry_(?!never)|restart|leap|jump|reset", r"leap|jump|restart|reset|odometry")
def odometry_restarts(r, chance, variant, more):
    at = int(len(r.odometry) * chance.uniform(0.3, 0.7))
    turn, start = about(2, -2 * math.atan2(*r.odometry[at].pose[5:7])), r.odometry[at].pose
    c, s = turn[3]**2 - turn[2]**2, 2 * turn[2] * turn[3]
    for o in r.odometry[at:]:
        x, y = o.pose[0] - start[0], o.pose[1] - start[1]
        o.pose = [c * x - s * y, s * x + c * y, o.pose[2]] + list(multiply(turn, o.pose[3:]))


@kind("scanner", "the odometry leaps by 4 to 6 m", ("room_camera", "office_scan"), "folder",
      r"odometry_(?!never)|leap|jump", r"leap|jump|odometry")
def odometry_leaps(r, chance, variant, more):
    at = int(len(r.odometry) * chance.uniform(0.3, 0.7))
    angle, far = chance.uniform(-math.pi, math.pi), chance.uniform(4, 6)
    for o in r.odometry[at:]:
        o.pose[0] += far * math.cos(angle)
        o.pose[1] += far * math.sin(angle)


@kind("scanner", "two robots in one tf tree", "office_scan", "bag", r"robot|base_frame|two_bodies",
      r"two|robot|frame",
      both=lambda c, v: {"lidar.forward_m": 0.3, "lidar.yaw_deg": c.uniform(20, 60)})
def two_robots(r, chance, variant, more):
    other = [Pose(o.true, o.stamp, [3 - o.pose[1], o.pose[0], 0] + list(
        multiply(about(2, math.pi / 2), o.pose[3:]))) for o in r.odometry]
    names = ("base_link", "robot2/base_link")
    tracks = [("odom", names[0], r.odometry), ("odom", names[1], other)]
    r.tf_odometry = tracks[::-1] if variant else tracks
    r.odometry = []


@kind("scanner", "two scanners on one topic", "office_scan", "bag",
      r"two_(scanner|laser|lidar|frame)", r"two|frame|both",
      more=lambda c, v: {"lidar.yaw_deg": 180 - 60 * v, "lidar.forward_m": -0.25})
def two_scanners_one_topic(r, chance, variant, more):
    for s in more.scans:
        s.frame = "laser_rear"
        s.stamp += 20 * SECOND // 1000
    r.static = [("base_link", "laser", r.mounting("lidar", "T_body_lidar")),
                ("base_link", "laser_rear", more.mounting("lidar", "T_body_lidar"))]
    r.scans = sorted(r.scans + more.scans, key=lambda s: (s.true, s.frame))


@kind("scanner", "scans of 57 degrees with 40 % lost, no wheels", "office_alone", "folder",
      r"tracking_lost|open_direction|field_of_view|narrow|motion_unknown",
      r"lost|direction|open|narrow|tracking",
      sim=lambda c, v: {"lidar.fov_deg": 57, "lidar.beams": 115, "lidar.dropout": 0.4})
def narrow_alone(r, chance, variant, more):
    pass


@kind("planar", "an aircraft's odometry stated planar", "flight", "folder", r"planar",
      r"planar|height|level")
def planar_flight(r, chance, variant, more):
    if variant:
        r.calibration["odometry"].pop("planar")
    else:
        r.calibration["odometry"]["planar"] = "true"


@kind("planar", "odometry with heights on a ramp, stated planar", "ramp_both", "folder",
      r"planar", r"planar|height|level|slope",
      both=lambda c, v: {"odometry.planar": "off"})
def planar_ramp(r, chance, variant, more):
    if variant:
        r.calibration["odometry"].pop("planar")
    else:
        r.calibration["odometry"]["planar"] = "true"


TF = r"tf_|transform|mounting|assumed|extrinsic|frame_|link"


@kind("extrinsics", "a bag without transforms, the scanner 0.3 m ahead and turned", "office_scan",
      "bag", TF, r"transform|tf|origin is assumed|mounting", both=lambda c, v: {
          "lidar.forward_m": c.uniform(0.25, 0.4), "lidar.yaw_deg": c.uniform(-60, 60)})
def no_transforms(r, chance, variant, more):
    r.static = []


@kind("extrinsics", "a link of the tf tree is missing", "office_scan", "bag", TF,
      r"transform|tf|link|mounting", both=lambda c, v: {
          "lidar.forward_m": c.uniform(0.25, 0.4), "lidar.yaw_deg": c.uniform(-60, 60)})
def missing_link(r, chance, variant, more):
    pose = r.mounting("lidar", "T_body_lidar")
    r.static = [("mast", "laser", pose)]
    if variant:
        r.static += [("base_link", "plate", [0, 0, 0.1, 0, 0, 0, 1])]


@kind("extrinsics", "a bag without transforms, mountings by --calibration", "office_scan", "bag",
      TF, r"(?!)", both=lambda c, v: {"lidar.forward_m": 0.3,
                                             "lidar.yaw_deg": c.uniform(-170, 170)})
def calibration_file(r, chance, variant, more):
    r.static = []
    r.extra_calibration = r.calibration_text()


@kind("extrinsics", "a folder that does not say where the scanner sits", "office_scan", "folder",
      TF, r"assumed|mounting|T_body_lidar", both=lambda c, v: {
          "lidar.forward_m": c.uniform(0.25, 0.4), "lidar.yaw_deg": 90 * v})
def no_place_of_scanner(r, chance, variant, more):
    r.calibration["lidar"].pop("T_body_lidar")
