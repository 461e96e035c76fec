"""Spoiled time: clocks that stop, wrap, leap and step back, holes, bursts, repeats, lost lines."""
from .kinds import cut, everything, kind, middle_of_turn, shift_stamps
from .recording import SECOND, Scan

CLOCK = r"clock|stamp|time_order|burst|jitter|odometry_never_meets"
CLOCK_WORDS = r"clock|stamp|time|order"
DROPPED = r"drop|skip|left_out|damaged|repeat|twice|duplicate"
HOLE = r"gap|hole|pause"


@kind("time", "all stamps of a log are one, two or three values", "room_scan", "log", CLOCK,
      CLOCK_WORDS)
def stamps_constant(r, chance, variant, more):
    values = [r.scans[0].stamp + k * SECOND for k in range(2 + variant)]
    items = sorted(everything(r), key=lambda i: i.true)
    for i, item in enumerate(items):
        item.stamp = values[i * len(values) // len(items)]


@kind("time", "stamps are zeros and rubbish", "office_scan", "log", CLOCK, CLOCK_WORDS)
def stamps_rubbish(r, chance, variant, more):
    for item in everything(r):
        item.stamp = chance.choice([0, 0, chance.randrange(2**31) * SECOND]) if variant else 0
        if not variant and chance.random() < 0.4:
            item.stamp = chance.randrange(1000) * SECOND


@kind("time", "the clock wraps to 4.29e9 s half-way", "office_scan", ("log", "folder"), CLOCK,
      CLOCK_WORDS)
def clock_wraps(r, chance, variant, more):
    first, last = r.odometry[0].true, r.odometry[-1].true
    middle = first + int(chance.uniform(0.3, 0.7) * (last - first))
    for item in everything(r):
        wrapped = (item.true < middle) != bool(variant)
        item.stamp = item.true - (first if variant else middle) + wrapped * 2**32 * SECOND
        item.stamp -= variant * wrapped * (last - first + SECOND)


@kind("time", "nothing at all is recorded for 3 s in a turn", "office_scan", ("log", "folder"),
      HOLE, r"gap|hole|pause")
def hole_of_all(r, chance, variant, more):
    start = middle_of_turn(r, chance) - SECOND * 3 // 2
    r.scans, r.odometry = (cut(i, start, start + 3 * SECOND) for i in (r.scans, r.odometry))


@kind("time", "a scan just inside a hole of the odometry, in a turn", "office_scan",
      ("folder", "log"), HOLE, r"gap|hole|pause")
def scan_inside_hole(r, chance, variant, more):
    start = middle_of_turn(r, chance) - SECOND
    inside = [s for s in r.scans if start < s.true < start + SECOND // 2][:1]
    r.odometry = cut(r.odometry, start, start + 5 * SECOND // 2)
    r.scans = sorted(cut(r.scans, start, start + 5 * SECOND // 2) + inside, key=lambda s: s.true)


@kind("time", "odometry alone is silent for 3 s beside a camera", "room_camera", "folder", HOLE,
      r"gap|hole|pause")
def hole_of_odometry(r, chance, variant, more):
    start = middle_of_turn(r, chance) - SECOND
    r.odometry = cut(r.odometry, start, start + 3 * SECOND)


@kind("time", "scans arrive in bursts after stalls of 1.2 to 2.5 s", "office_scan",
      ("log", "bag"), CLOCK, CLOCK_WORDS)
def bursts(r, chance, variant, more):
    begin, span = r.scans[0].true, r.scans[-1].true - r.scans[0].true
    for k in range(4):
        start = begin + int(span * (k + chance.uniform(0.2, 0.6)) / 4)
        end = start + int(chance.uniform(1.2, 2.5) * SECOND)
        stalled = [s for s in r.scans if start < s.true < end]
        for i, scan in enumerate(stalled):
            scan.stamp = end + (i - len(stalled)) * 4 * SECOND // 1000


@kind("time", "microseconds are written without leading zeros", "office_scan", "log", CLOCK,
      CLOCK_WORDS)
def microseconds_unpadded(r, chance, variant, more):
    def text(_, ns):
        return f"{ns // SECOND}.{ns % SECOND // 1000}"
    r.log_stamps = text
    shift_stamps(everything(r), chance.uniform(0.02, 0.09))
    if variant:  # and a wandering clock, so that fractions of all sizes are there
        for item in everything(r):
            item.stamp += (item.true - r.odometry[0].true) // 1000


@kind("time", "a third of the scans has the stamp of the one before", "office_scan",
      ("folder", "bag"), CLOCK + "|" + DROPPED, CLOCK_WORDS + "|same|equal|repeated")
def equal_stamps(r, chance, variant, more):
    for before, scan in zip(r.scans, r.scans[1:]):
        if chance.random() < 0.33:
            scan.stamp = before.stamp


@kind("time", "stamps of scans jitter by 0.3 s", "office_scan", ("folder", "bag"), CLOCK,
      CLOCK_WORDS)
def jitter(r, chance, variant, more):
    for scan in r.scans:
        scan.stamp += int(chance.uniform(-0.3, 0.3) * SECOND)


@kind("time", "some stamps are 1 ms before the one before", "office_scan", ("folder", "bag"),
      CLOCK + "|" + DROPPED, CLOCK_WORDS)
def back_1_ms(r, chance, variant, more):
    for before, scan in zip(r.scans, r.scans[1:]):
        if chance.random() < 0.1:
            scan.stamp = before.stamp - SECOND // 1000


def step_back(r, chance, seconds):
    span = r.odometry[-1].true - r.odometry[0].true
    at = r.odometry[0].true + int(chance.uniform(0.3, 0.7) * span)
    shift_stamps([i for i in everything(r) if i.true >= at], -seconds)


@kind("time", "the clock steps back by 1.3 s", "office_scan", ("bag", "folder"),
      CLOCK + "|" + DROPPED, CLOCK_WORDS)
def back_1_s(r, chance, variant, more):
    step_back(r, chance, 1.3)


@kind("time", "the clock steps back by 1000 s", "office_scan", ("log", "folder"),
      CLOCK + "|" + DROPPED, CLOCK_WORDS)
def back_1000_s(r, chance, variant, more):
    step_back(r, chance, 1000)


@kind("time", "odometry and scans lie days apart", "office_scan", ("folder", "bag"), CLOCK,
      CLOCK_WORDS)
def days_apart(r, chance, variant, more):
    shift_stamps(r.odometry, chance.choice([-1, 1]) * chance.uniform(1, 400) * 86400)


@kind("time", "every scan is published twice, 1 ms apart", "office_scan", ("folder", "bag"),
      CLOCK + "|" + DROPPED, r"twice|repeat|duplicate|same")
def scans_twice(r, chance, variant, more):
    out = []
    for s in r.scans:
        out += [s, Scan(s.true, s.stamp + SECOND // 1000, s.first, s.step, s.least, s.most,
                        list(s.ranges))]
    r.scans = out


@kind("time", "stamps in whole seconds", "office_scan", ("folder", "log"), CLOCK, CLOCK_WORDS)
def whole_seconds(r, chance, variant, more):
    for item in everything(r):
        item.stamp -= item.stamp % SECOND


@kind("time", "3 to 8 % of the lines are damaged", "office_scan", ("folder", "log"),
      DROPPED + "|line|not_a_number", r"damaged|not a number|short line|skipped|left out|cut")
def damaged_lines(r, chance, variant, more):
    share = chance.uniform(0.03, 0.08)

    def spoil(lines):
        return [line.replace(".", ".x", 3) if chance.random() < share else line
                for line in lines]
    r.lines_of["scans.csv"] = spoil
    r.log_lines = spoil


@kind("time", "stamps of scans are 0.2 to 0.5 s late", "office_scan", ("folder", "bag"),
      CLOCK + "|delay|late", CLOCK_WORDS + "|late|delay")
def scans_late(r, chance, variant, more):
    shift_stamps(r.scans, chance.uniform(0.2, 0.5))


@kind("time", "stamps of images are 0.2 to 0.5 s late", "room_camera", "folder",
      CLOCK + "|delay|late", CLOCK_WORDS + "|late|delay")
def images_late(r, chance, variant, more):
    shift_stamps(r.depth, chance.uniform(0.2, 0.5))


@kind("time", "the odometry's clock runs 2 to 4 % fast", "office_scan", ("folder", "bag"), CLOCK,
      CLOCK_WORDS)
def odometry_clock_fast(r, chance, variant, more):
    rate, start = chance.uniform(0.02, 0.04), r.odometry[0].true
    for o in r.odometry:
        o.stamp += int(rate * (o.true - start))


@kind("time", "wheels' messages come 0.3 s late now and then", "office_scan", ("bag", "folder"),
      CLOCK, CLOCK_WORDS)
def odometry_jitter(r, chance, variant, more):
    for o in r.odometry:
        if chance.random() < 0.2:
            o.stamp += int(abs(chance.gauss(0, 0.15)) * SECOND)
