"""The table of kinds: what is spoiled, on which scene, and which warnings name it."""
import dataclasses
import math

from .recording import SECOND, about, yaw_of


@dataclasses.dataclass
class Kind:
    name: str
    group: str
    says: str          # one line for the table
    bases: tuple       # base scene of either variant
    formats: tuple     # format of either variant
    ids: str           # pattern of the ids of warnings that name it
    words: str         # pattern of messages that name it, for exit 2 and programs without ids
    spoil: object      # function of (recording, chance, variant, more)
    sim: object        # settings of the simulation of case (not of its twin), by (chance, variant)
    both: object       # settings of both, by (chance, variant)
    prepare: object    # done to both, case and twin
    more: object       # settings of a second recording that the spoiler may take from
    twin_format: str


KINDS = {}


def kind(group, says, base, formats, ids, words, sim=None, both=None, prepare=None, more=None,
         twin_format=""):
    """Registers a spoiler under its function's name. One base or format: for both variants."""
    def two(value):
        return value if isinstance(value, tuple) else (value, value)

    def register(spoil):
        name = spoil.__name__
        KINDS[name] = Kind(name, group, says, two(base), two(formats), ids, words, spoil, sim,
                           both, prepare, more, twin_format)
        return spoil
    return register


# What several spoilers need.

def turn_of(poses, i):
    a, b = poses[i - 1], poses[i]
    return math.remainder(yaw_of(b.pose) - yaw_of(a.pose), 2 * math.pi)


def middle_of_turn(r, chance):
    """Time in the middle of a turn of the robot, by its true path; not the first, not the last."""
    times = sorted(r.truth)
    yaws = [yaw_of(r.truth[t]) for t in times]
    turns, start = [], None
    for i in range(1, len(times)):
        rate = math.remainder(yaws[i] - yaws[i - 1], 2 * math.pi) * SECOND
        turning = abs(rate) > 0.2 * (times[i] - times[i - 1])
        if turning and start is None:
            start = times[i]
        if not turning and start is not None:
            if times[i] - start > SECOND // 2:
                turns.append((start + times[i]) // 2)
            start = None
    inner = turns[1:-1] or turns or [times[len(times) // 2]]
    return chance.choice(inner)


def cut(items, start, end):
    return [i for i in items if not start < i.true < end]


def remake_odometry(r, change):
    """Integrates the wheels' steps anew: change(ahead, left, turn, index) of each."""
    old = [o.pose for o in r.odometry]
    x, y, yaw = old[0][0], old[0][1], yaw_of(old[0])
    for i in range(1, len(old)):
        a = yaw_of(old[i - 1])
        dx, dy = old[i][0] - old[i - 1][0], old[i][1] - old[i - 1][1]
        ahead, left = math.cos(a) * dx + math.sin(a) * dy, -math.sin(a) * dx + math.cos(a) * dy
        turn = math.remainder(yaw_of(old[i]) - a, 2 * math.pi)
        ahead, left, turn = change(ahead, left, turn, i)
        x += math.cos(yaw) * ahead - math.sin(yaw) * left
        y += math.sin(yaw) * ahead + math.cos(yaw) * left
        yaw += turn
        r.odometry[i].pose = [x, y, old[i][2]] + list(about(2, yaw))


def shift_stamps(items, seconds):
    for item in items:
        item.stamp += round(seconds * SECOND)


def everything(r):
    return r.scans + r.depth + r.left + r.right + r.odometry
