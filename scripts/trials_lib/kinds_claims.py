"""What files claim of their sensors: noise, apertures, codes, sizes, scales."""
import math

from .kinds import kind

NOISE = r"range_noise(?!_hides)|range_sigma|accuracy"
APERTURE = r"field_of_view|aperture|angle|fov|beam"
APERTURE_WORDS = r"aperture|field of view|angle|degrees"
CODE = r"no_return|range_max|range_code|range_limit"
CODE_WORDS = r"no return|range_max|code|65535"
LENS = r"focal|camera_info|intrinsic|image_size|principal_point|camera_matrix"
LENS_WORDS = r"focal|fx|camera.?info|\bK\b|size|intrinsic"


@kind("claims", "ROBOTLASER says accuracy 0.1 m and 0.2 m", "office_scan", "log", NOISE,
      r"accuracy|noise|range_sigma")
def carmen_accuracy(r, chance, variant, more):
    r.robotlaser = 0.2 if variant else 0.1


@kind("claims", "range_sigma stated 0.3 to 0.5 m, or 0.1 mm, for 1 cm", "office_scan",
      ("folder", "folder"), NOISE, r"noise|range_sigma")
def range_sigma_wrong(r, chance, variant, more):
    r.calibration["lidar"]["range_sigma"] = "0.0001" if variant else f"{chance.uniform(.3, .5):.3f}"


@kind("claims", "ranges that scatter by 4 to 6 cm, range_sigma not stated", "office_scan",
      ("folder", "bag"), NOISE, r"noise|range_sigma",
      both=lambda c, v: {"lidar.range_sigma_m": c.uniform(0.04, 0.06)})
def range_sigma_absent(r, chance, variant, more):
    r.calibration["lidar"].pop("range_sigma")


def halve(r):
    for s in r.scans:
        s.first, s.step = s.first / 2, s.step / 2


@kind("claims", "the stated aperture is half of the true one", "office_scan", ("folder", "bag"),
      APERTURE, APERTURE_WORDS)
def aperture_halved(r, chance, variant, more):
    halve(r)


@kind("claims", "ROBOTLASER states half of the aperture", ("room_scan", "office_scan"), "log",
      APERTURE, APERTURE_WORDS)
def aperture_halved_log(r, chance, variant, more):
    r.robotlaser = 0.01
    halve(r)


def param_fov(v):
    return {"lidar.beams": 181 if v else 421, "lidar.fov_deg": 100 if v else 210}


@kind("claims", "FLASER of 421 beams over 210 degrees by PARAM, of 181 over 100", "office_scan",
      "log", APERTURE, APERTURE_WORDS, both=lambda c, v: param_fov(v), twin_format="folder")
def fov_by_param(r, chance, variant, more):
    fov, beams = param_fov(variant)["lidar.fov_deg"], len(r.scans[0].ranges)
    r.log_head += [f"PARAM laser_front_laser_fov {fov}",
                   f"PARAM laser_front_laser_resolution {fov / (beams - 1):.6f}"]


@kind("claims", "time_increment three times too long", "office_scan", "bag",
      r"time_increment|sweep|scan_duration|scan_time", r"time_increment|sweep|duration",
      both=lambda c, v: {"lidar.sweep_s": 0.1, "path.turn_rate": c.uniform(1.2, 2.0)},
      prepare=lambda r: setattr(r, "time_increment", 0.1 / (len(r.scans[0].ranges) - 1)))
def time_increment_wrong(r, chance, variant, more):
    r.time_increment *= 3


SHORT = {"lidar.range_max_m": 3.5}


@kind("claims", "no return is a little below range_max (9.99 of 10)", "office_scan",
      ("folder", "bag"), CODE, CODE_WORDS, both=lambda c, v: SHORT)
def code_below_max(r, chance, variant, more):
    for s in r.scans:
        s.most = 10.0
        s.ranges = [x if x > 0 else 9.99 for x in s.ranges]


@kind("claims", "no return is 51.14 to 51.16, one 51.25, in a log", "office_scan", "log", CODE,
      CODE_WORDS, both=lambda c, v: SHORT)
def code_scattered(r, chance, variant, more):
    for s in r.scans:
        s.ranges = [x if x > 0 else chance.uniform(51.14, 51.16) for x in s.ranges]
    r.scans[chance.randrange(len(r.scans))].ranges[3] = 51.25
    if variant:  # 81.83 and the like, and a maximum above them
        r.log_head.append("PARAM robot_front_laser_max 82.0")
        for s in r.scans:
            s.ranges = [x if x < 50 else chance.choice([81.83, 81.87, 81.91]) for x in s.ranges]


@kind("claims", "range_max is stated below half of the ranges", "office_scan", ("folder", "bag"),
      CODE, CODE_WORDS)
def range_max_low(r, chance, variant, more):
    for s in r.scans:
        s.most = chance.choice([1.5])


@kind("claims", "a 5 m scanner is driven as a 12 m one: noise beyond", "corridor_scan",
      ("folder", "bag"), CODE + r"|range_noise(?!_hides)|beyond|reach", r"noise|beyond|range")
def noise_beyond_reach(r, chance, variant, more):
    reach = chance.uniform(4, 5)
    for s in r.scans:
        s.most = 12.0
        s.ranges = [x if 0 < x < reach else chance.uniform(reach, 11.9) for x in s.ranges]


@kind("claims", "angles in degrees for radians", "office_scan", ("folder", "bag"), APERTURE,
      APERTURE_WORDS + r"|turn|increment")
def angles_in_degrees(r, chance, variant, more):
    for s in r.scans:
        s.first, s.step = math.degrees(s.first), math.degrees(s.step)


@kind("claims", "ranges in millimetres, or centimetres, for metres", "office_scan",
      ("folder", "bag"), r"unit|milli|range_(max|scale|unit)", r"milli|centi|unit|range|metres")
def ranges_in_millimetres(r, chance, variant, more):
    k = 100 if variant else 1000
    for s in r.scans:
        s.most *= k
        s.ranges = [k * x for x in s.ranges]


@kind("claims", "no measurement is 65535 in depth images", "room_camera", ("folder", "bag"), CODE,
      CODE_WORDS, both=lambda c, v: {"camera.depth_scale": 1000})
def code_65535(r, chance, variant, more):
    for picture in r.depth:
        pixels = picture.read()
        for i, p in enumerate(pixels):
            if p == 0:
                pixels[i] = 65535


def camera_k(r):
    r.depth[0].read()
    camera = r.calibration["depth_camera"]
    return (r.depth[0].width, r.depth[0].height,
            tuple(float(camera[k]) for k in ("fx", "fy", "cx", "cy")))


@kind("claims", "CameraInfo of twice or half the size", "room_camera", "bag", LENS, LENS_WORDS)
def info_of_other_size(r, chance, variant, more):
    w, h, k = camera_k(r)
    n = 0.5 if variant else 2
    r.info = (int(n * w), int(n * h), tuple(n * x for x in k))


@kind("claims", "K of zeros, or the identity", "room_camera", "bag", LENS, LENS_WORDS)
def k_unset(r, chance, variant, more):
    w, h, _ = camera_k(r)
    r.info = (w, h, (1, 1, 0, 0) if variant else (0, 0, 0, 0))


@kind("claims", "K with NaN", "room_camera", "bag", LENS, LENS_WORDS)
def k_nan(r, chance, variant, more):
    w, h, k = camera_k(r)
    k = list(k)
    k[2 if variant else 0] = math.nan
    r.info = (w, h, tuple(k))


@kind("claims", "a focal length that is denormal", "room_camera", ("folder", "bag"), LENS,
      LENS_WORDS)
def focal_denormal(r, chance, variant, more):
    w, h, k = camera_k(r)
    r.calibration["depth_camera"]["fx"] = "6.9e-310"
    r.info = (w, h, (6.9e-310, *k[1:]))


@kind("claims", "the focal length is 8 to 15 % wrong", "room_camera", "folder", LENS, LENS_WORDS)
def focal_wrong(r, chance, variant, more):
    k = 1 + chance.uniform(0.08, 0.15) if variant else 1 - chance.uniform(0.08, 0.15)
    for key in ("fx", "fy"):
        r.calibration["depth_camera"][key] = f"{k * r.number('depth_camera', key):.4f}"


@kind("claims", "focal length of the image of twice the size", ("room_camera", "room_both"),
      "folder", LENS, LENS_WORDS)
def focal_of_full_size(r, chance, variant, more):
    for key in ("fx", "fy"):
        r.calibration["depth_camera"][key] = f"{2 * r.number('depth_camera', key):.4f}"


@kind("claims", "cx and cy of 0", ("room_camera", "room_both"), "folder",
      r"cx|principal|intrinsic|image_size", r"cx|principal|camera")
def centre_zero(r, chance, variant, more):
    r.calibration["depth_camera"]["cx"] = "0"
    if not variant:
        r.calibration["depth_camera"]["cy"] = "0"


@kind("claims", "the baseline is stated ten times, or a tenth", "room_stereo", "folder",
      r"baseline|depth_scale|camera_height|floor_height", r"baseline|stereo|height|scale")
def baseline_wrong(r, chance, variant, more):
    k = 0.1 if variant else 10
    r.calibration["stereo_camera"]["baseline"] = f"{k * r.number('stereo_camera', 'baseline'):.6f}"


@kind("claims", "depth is stretched by up to 8 %, each image otherwise", "room_camera", "folder",
      r"depth_(noise|stretch|scale)|stretch", r"depth|stretch|scale")
def depth_stretched(r, chance, variant, more):
    for picture in r.depth:
        k, pixels = 1 + chance.uniform(-0.08, 0.08), picture.read()
        for i, p in enumerate(pixels):
            pixels[i] = int(k * p)


@kind("claims", "depth in 32FC1 is millimetres", ("room_camera", "room_both"), "bag",
      r"unit|milli|scale", r"milli|unit|scale")
def depth_in_millimetres(r, chance, variant, more):
    r.encoding = "32FC1 mm"


@kind("claims", "depth_scale 1000 for 5000, or 5000 for 1000", "room_camera", "folder",
      r"scale|unit|milli", r"depth_scale|scale|height",
      both=lambda c, v: {"camera.depth_scale": 1000 if v else 5000})
def depth_scale_wrong(r, chance, variant, more):
    r.calibration["depth_camera"]["depth_scale"] = "5000" if variant else "1000"
