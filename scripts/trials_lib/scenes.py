"""Base scenes: small, a few seconds of work each. Those with a file are made here."""
import math

SMALL_CAMERA = {"camera.width": 160, "camera.height": 120}
HALF_TURN = {"lidar.rate_hz": 5, "lidar.beams": 181, "lidar.fov_deg": 180}  # as FLASER lines have
LAP = {"path.speed": 0.7, "path.turn_rate": 1.0}

BASES = {  # name: (scene, settings, has a camera)
    "room_scan": ("room", {"camera.enabled": "off", **HALF_TURN, **LAP}, False),
    "office_scan": ("office", {"office.rooms_per_side": 1, "camera.enabled": "off", **HALF_TURN},
                    False),
    "office_alone": ("office", {"office.rooms_per_side": 1, "camera.enabled": "off",
                                "odometry.enabled": "off", "lidar.rate_hz": 5,
                                "lidar.beams": 361, "lidar.fov_deg": 360}, False),
    "corridor_scan": ("corridor_loop", {"path.laps": 1, "camera.enabled": "off",
                                        "lidar.rate_hz": 4, "lidar.beams": 271,
                                        "lidar.fov_deg": 270}, False),
    "room_camera": ("room", {"lidar.enabled": "off", "camera.rate_hz": 3, **LAP, **SMALL_CAMERA}, True),
    "room_both": ("room", {"camera.rate_hz": 2, "lidar.rate_hz": 5, "lidar.beams": 271,
                           "lidar.fov_deg": 270, **LAP, **SMALL_CAMERA}, True),
    "room_stereo": ("room", {**LAP, "camera.enabled": "off", "lidar.enabled": "off",
                             "stereo.enabled": "on", "stereo.width": 320, "stereo.height": 240,
                             "stereo.fx": 250, "stereo.rate_hz": 3}, True),
    "flight": ("flyover", {"flight.length_m": 120, "lidar.beams": 241, "sway.height_m": 3}, False),
    "ramp_both": ("ramp", {"camera.rate_hz": 2, "lidar.rate_hz": 5, "lidar.beams": 271,
                           "lidar.fov_deg": 270, "path.speed": 0.8, **SMALL_CAMERA}, True),
    "hall_scan": ("hall", {"camera.enabled": "off", "lidar.enabled": "on", "lidar.rate_hz": 5,
                           "lidar.beams": 271, "lidar.fov_deg": 270, "lidar.height_m": 0.15,
                           "odometry.sigma_rotation": 0.01}, False),
    "hall_camera": ("hall", {"camera.rate_hz": 3, "camera.pitch_deg": 25,
                             "odometry.sigma_rotation": 0.01, **SMALL_CAMERA}, True),
}

WAY = [(1.5, 1.5), (6.5, 1.5), (6.5, 4.5), (1.5, 4.5), (1.5, 1.6)]


def swell(x, y, height, length):
    return height * math.sin(2 * math.pi * x / length) * math.cos(2 * math.pi * y / (1.3 * length))


def _mesh(file, height, length):
    n, m, step = 33, 25, 0.25
    lines = [f"v {i * step} {j * step} {swell(i * step, j * step, height, length):.5f}"
             for j in range(m) for i in range(n)]
    for j in range(m - 1):
        for i in range(n - 1):
            a = j * n + i + 1
            lines += [f"f {a} {a + 1} {a + n + 1}", f"f {a} {a + n + 1} {a + n}"]
    file.write_text("\n".join(lines) + "\n")


def _fine(points, step=0.1):
    out = []
    for (x0, y0), (x1, y1) in zip(points, points[1:]):
        n = max(1, round(math.hypot(x1 - x0, y1 - y0) / step))
        out += [(x0 + (x1 - x0) * k / n, y0 + (y1 - y0) * k / n) for k in range(n)]
    return out + [points[-1]]


def write_hall(folder, sway=None, height=0.0, length=2.0):
    """A hall of 8 x 6 m with four boxes; a body that sways (degrees), a floor with swells (m)."""
    folder.mkdir(parents=True, exist_ok=True)
    text = "name: hall\n"
    if height:
        _mesh(folder / "floor.obj", height, length)
        text += "meshes: [{name: floor, file: floor.obj}]\n"
        half = 0.2  # m between the body's middle and its axles
        points = [(x, y, (swell(x - half, y, height, length) +
                          swell(x + half, y, height, length)) / 2) for x, y in _fine(WAY)]
    else:
        text += "ground: [{name: floor, area: [0, 0, 8, 6], z: 0}]\n"
        points = [(x, y, 0) for x, y in WAY]
    text += "walls:\n"
    corners = [(0, 0), (8, 0), (8, 6), (0, 6), (0, 0)]
    for a, b in zip(corners, corners[1:]):
        text += f"  - {{from: [{a[0]}, {a[1]}], to: [{b[0]}, {b[1]}], z: [-0.1, 2.6]}}\n"
    text += "boxes:\n"
    for x, y, yaw, w, d, h in ((4, 3, 15, 1.2, 0.7, 0.9), (7.6, 5.2, 0, 0.5, 1.2, 1.6),
                               (0.4, 3.1, 0, 0.6, 1.0, 0.8), (3, 5.7, 0, 1.4, 0.4, 1.2)):
        text += f"  - {{at: [{x}, {y}, 0], yaw_deg: {yaw}, size: [{w}, {d}, {h}]}}\n"
    text += "path:\n  speed: 0.6\n  turn_rate: 0.9\n  points:\n"
    text += "".join(f"    - [{x:.3f}, {y:.3f}, {z:.5f}]\n" for x, y, z in points)
    if sway:
        text += "  sway: {" + ", ".join(f"{k}: {v}" for k, v in sway.items()) + "}\n"
    text += "settings: {odometry.rate_hz: 20}\n"
    file = folder / "hall.yaml"
    file.write_text(text)
    return file
