"""Cameras against what they see: mountings, turned and swapped images, smears, flying pixels."""
import math

from .kinds import kind
from .recording import multiply

CAMERA = r"camera_(?!optical|upside|mirror)|floor_(height|unseen)|mounting|extrinsic"
CAMERA_WORDS = r"camera|T_body_camera|height"
TURNED = r"upside|mirror|camera_turned|images_turned"


@kind("cameras", "the camera's height is stated 1.5 to 2 times, or .5 to .7", "room_camera",
      "folder", CAMERA, CAMERA_WORDS)
def camera_height(r, chance, variant, more):
    pose = r.mounting("depth_camera", "T_body_camera")
    pose[2] *= chance.uniform(0.5, 0.7) if variant else chance.uniform(1.5, 2)
    r.mount("depth_camera", "T_body_camera", pose)


@kind("cameras", "images upside down, stated upright", ("room_camera", "room_both"), "folder",
      TURNED, r"upside|turned|180")
def images_upside_down(r, chance, variant, more):
    for picture in r.depth:
        picture.read().reverse()


@kind("cameras", "images mirrored left to right", ("room_camera", "room_both"), "folder", TURNED,
      r"mirror|turned|left")
def images_mirrored(r, chance, variant, more):
    for picture in r.depth:
        pixels, w = picture.read(), picture.width
        for v in range(picture.height):
            pixels[v * w:(v + 1) * w] = pixels[v * w:(v + 1) * w][::-1]


@kind("cameras", "the camera's pitch is stated 30 to 45 degrees wrong",
      ("room_camera", "room_both"), "folder", CAMERA, CAMERA_WORDS)
def camera_pitch(r, chance, variant, more):
    angle = chance.uniform(30, 45) * (-1 if variant else 1)
    r.turn_mounting("depth_camera", 1, math.radians(angle))


@kind("cameras", "a level camera at eye's height, stated pitched and low", "room_camera", "folder",
      CAMERA, CAMERA_WORDS, both=lambda c, v: {"camera.pitch_deg": -8 * v,
                                                          "camera.height_m": 1.2})
def camera_without_floor(r, chance, variant, more):
    r.turn_mounting("depth_camera", 1, math.radians(25))
    pose = r.mounting("depth_camera", "T_body_camera")
    pose[2] = 0.5
    r.mount("depth_camera", "T_body_camera", pose)


@kind("cameras", "the camera looks sideways or backwards, stated ahead", "room_camera", "folder",
      r"camera_(?!optical|upside|mirror|height|pitch)|mounting|extrinsic",
      r"camera.*(turn|yaw)|heading|sideway|backward")
def camera_sideways(r, chance, variant, more):
    r.turn_mounting("depth_camera", 2, math.pi if variant else math.pi / 2)


@kind("cameras", "no rotation into the optical frame", "room_camera", "folder", "camera_optical",
      CAMERA_WORDS + "|optical")
def optical_frame(r, chance, variant, more):
    pose = r.mounting("depth_camera", "T_body_camera")
    # Left out: the turn from x right, y down, z ahead to x ahead, y left, z up.
    turn = multiply(pose[3:], (0.5, -0.5, 0.5, 0.5)) if variant else (0, 0, 0, 1)
    r.mount("depth_camera", "T_body_camera", pose[:3] + list(turn))


@kind("cameras", "right images are one pair late", "room_stereo", "folder",
      r"stereo_(late|pair|unmatched)|right_image", r"right|stereo|pair|left")
def right_images_late(r, chance, variant, more):
    n = 1 + variant
    for i in range(len(r.right) - 1, n - 1, -1):
        r.right[i].file = r.right[i - n].file


@kind("cameras", "left and right images are swapped", "room_stereo", "folder",
      r"swap|stereo_unmatched|left_right", r"swap|left|right")
def left_right_swapped(r, chance, variant, more):
    for a, b in zip(r.left, r.right):
        if not variant or chance.random() < 0.5:
            a.file, b.file = b.file, a.file


@kind("cameras", "the body pitches by 2 to 3 degrees, which planar wheels do not say",
      "hall_camera", "folder", r"body_pitch|tilt|rock|sway|body",
      r"pitch|tilt|rock|lean|level",
      sim=lambda c, v: {"hall.sway_pitch_deg": c.uniform(2, 3),
                        "hall.sway_period_s": c.uniform(1.5, 4)})
def body_pitches(r, chance, variant, more):
    pass


@kind("cameras", "a temporal filter smears the depth while the robot drives", "room_camera",
      "folder", r"smear|filter|depth_|camera_late|lag", r"smear|filter|lag|depth",
      both=lambda c, v: {"camera.rate_hz": 8, "camera.width": 120, "camera.height": 90})
def depth_smeared(r, chance, variant, more):
    share, mean = chance.uniform(0.15, 0.3), None
    for picture in r.depth:
        pixels = picture.read()
        if mean is None:
            mean = list(pixels)
        mean = [m + share * (p - m) if p and m else p or m for p, m in zip(pixels, mean)]
        for i, m in enumerate(mean):
            pixels[i] = int(m)


@kind("cameras", "pixels fly at edges", "room_camera", "folder", r"flying|edge|mixed|depth_",
      r"edge|flying|mixed|noisy")
def pixels_fly(r, chance, variant, more):
    share, reach = chance.uniform(0.5, 0.9), 2 + variant
    for picture in r.depth:
        pixels = picture.read()
        seen = list(pixels)
        for k in range(reach, len(pixels) - reach - 1):
            a, b = seen[k], seen[k + 1]
            if a and b and abs(a - b) > 0.12 * min(a, b):
                for j in range(k - reach + 1, k + reach + 1):
                    if chance.random() < share:
                        pixels[j] = int(min(a, b) + chance.random() * abs(a - b))


@kind("cameras", "rows of the images are noise below a line (a broken cable)", "room_camera",
      "folder", r"depth_|damage|image", r"depth|noise|noisy|damaged|image")
def rows_of_noise(r, chance, variant, more):
    share = chance.uniform(0.2, 0.4)
    for picture in r.depth:
        pixels, w = picture.read(), picture.width
        first = int(picture.height * (1 - share)) * w if variant else 0
        last = len(pixels) if variant else int(picture.height * share) * w
        for k in range(first, last):
            pixels[k] = chance.randrange(2500, 30000)
