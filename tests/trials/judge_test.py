"""The judge of scripts/trials on made maps of a small room: true, moved, mirrored, off, short."""
import math
import pathlib
import struct
import sys
import tempfile
import unittest

sys.path.insert(0, sys.argv.pop(1))
from trials_lib import images, judge, kinds, recording  # noqa: E402

W, H, R = 80, 60, 0.05  # cells of the room, m
CHEST = (10, 30, 10, 20)  # cells: x from, to, y from, to


def solid(i, j):
    return (i < 2 or j < 2 or i >= W - 2 or j >= H - 2 or
            (CHEST[0] <= i < CHEST[1] and CHEST[2] <= j < CHEST[3]))


class FakeRecording:
    def __init__(self):
        self.truth = {}
        for k in range(60):
            angle = 2 * math.pi * k / 60
            x, y = 2.6 + 0.8 * math.cos(angle), 1.9 + 0.5 * math.sin(angle) * (1 + 0.3 * (k < 20))
            self.truth[(k + 1) * 10**9] = [x, y, 0, 0, 0, 0, 1]

    def frames(self):
        return [(t, t) for t in self.truth]


def write_map(folder, move=lambda x, y: (x, y), shift=0.0, poses=60, keep=lambda i, j: True):
    """A map in a frame that `move` gives; `shift` m off every wall and obstacle."""
    rec = FakeRecording()
    lines = []
    for t, pose in list(rec.truth.items())[:poses]:
        x, y = move(pose[0], pose[1])
        lines.append(f"{recording.text_of(t)} {x:.6f} {y:.6f} 0 0 0 0 1")
    (folder / "trajectory.txt").write_text("\n".join(lines) + "\n")
    size, half = 160, 80
    pixels = bytearray([205]) * (size * size)
    for j in range(2 * H):
        for i in range(2 * W):  # twice as fine, so that moved cells leave no gaps
            x, y = (i + 0.5) * R / 2, (j + 0.5) * R / 2
            a, b = i // 2, j // 2
            if not keep(a, b):
                continue
            if shift and solid(a, b):
                y += shift
            u, v = (math.floor(c / R) for c in move(x, y))
            pixels[(half - 1 - v) * size + u + half] = 0 if solid(a, b) else 254
    (folder / "occupancy.pgm").write_bytes(b"P5\n%d %d\n255\n" % (size, size) + bytes(pixels))
    (folder / "occupancy.yaml").write_text(
        f"resolution: {R}\norigin: [{-half * R}, {-half * R}, 0]\n")
    return rec


def write_truth(folder):
    values = [0.0 if solid(i, j) else 1.0 for j in range(H) for i in range(W)]
    (folder / "truth_reachable.pfm").write_bytes(
        b"Pf\n%d %d\n-1.0\n" % (W, H) + struct.pack(f"<{W * H}f", *values))
    (folder / "truth.yaml").write_text(
        f"grid: {{resolution: {R}, origin: [0, 0], width: {W}, height: {H}}}\n")


class JudgeTest(unittest.TestCase):
    def verdict(self, **how):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            write_truth(folder)
            rec = write_map(folder, **how)
            return judge.judge(folder, rec, judge.TruthGrid(folder, False), False, 0.0)

    def test_the_true_map_is_right(self):
        verdict = self.verdict()
        self.assertTrue(verdict.right, verdict.why)
        self.assertLess(verdict.ate, 1e-5)

    def test_a_map_in_another_frame_is_right(self):
        c, s = math.cos(0.5), math.sin(0.5)
        verdict = self.verdict(move=lambda x, y: (c * (x - 2) - s * (y - 1), s * (x - 2) + c * (y - 1)))
        self.assertTrue(verdict.right, verdict.why)

    def test_a_mirrored_map_is_wrong(self):
        self.assertIn("ATE", self.verdict(move=lambda x, y: (x, 3 - y)).why)

    def test_walls_off_by_a_metre_are_wrong(self):
        self.assertIn("occupied", self.verdict(shift=-0.9).why)

    def test_a_third_of_the_poses_is_not_all(self):
        self.assertIn("20 poses of 60", self.verdict(poses=20).why)

    def test_frames_with_equal_stamps_pair_in_order(self):
        path = [(10**9, (0, 0, 0)), (10**9 + 5, (1, 0, 0)), (2 * 10**9, (2, 0, 0))]
        frames = [(10**9, 1), (10**9, 2), (2 * 10**9, 3)]
        pairs, by_stamp = judge.pair(path, frames)
        self.assertEqual([true for _, true in pairs], [1, 2, 3])
        self.assertFalse(by_stamp)


class FilesTest(unittest.TestCase):
    def test_a_png_comes_back(self):
        import array
        pixels = array.array("H", [0, 1, 256, 65535, 7, 40000])
        self.assertEqual(images.read_png(images.write_png(3, 2, pixels)), (3, 2, pixels))

    def test_stamps_keep_their_nanoseconds(self):
        self.assertEqual(recording.text_of(recording.ns_of("1234.000000001")), "1234.000000001")

    def test_wheels_remade_unchanged_are_the_same(self):
        rec = FakeRecording()
        rec.odometry = [recording.Pose(t, t, list(p)) for t, p in rec.truth.items()]
        kinds.remake_odometry(rec, lambda ahead, left, turn, index: (ahead, left, turn))
        self.assertAlmostEqual(rec.odometry[-1].pose[1], list(rec.truth.values())[-1][1], 9)


unittest.main()
