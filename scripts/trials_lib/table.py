"""The table: one line a case, a summary, and docs/trials.md."""
import collections

from .trial import ALARM, BROKEN, HANG, POOR, RIGHT, SAID, SILENT

ORDER = (RIGHT, SAID, POOR, SILENT, ALARM, HANG, BROKEN)
HEAD = ("case                        outcome          ATE m  window   twin  CPU s  why; warnings")


def metres(value):
    return f"{value:7.3f}" if value == value else "      -"


def line(r):
    words = [r.why] if r.why else []
    if r.message:
        words.append(r.message.splitlines()[-1])
    if r.warnings:
        words.append("warns: " + " | ".join(w[:90] for w in r.warnings))
    return (f"{r.name:<27} {r.outcome:<14}{metres(r.ate)} {metres(r.ate_window)} {metres(r.twin)} "
            f"{r.seconds:5.1f}  " + "; ".join(words)).rstrip()


def counts_of(results):
    counts = collections.Counter(r.outcome for r in results)
    return ", ".join(f"{counts[o]} {o}" for o in ORDER if counts[o])


def kinds_right(results):
    """Kinds whose both variants are right; of how many."""
    by_kind = collections.defaultdict(list)
    for r in results:
        by_kind[r.name.rpartition(".")[0]].append(r.outcome)
    return sum(all(o == RIGHT for o in outcomes) for outcomes in by_kind.values()), len(by_kind)


def summary(results, twins):
    out = []
    for group in dict.fromkeys(r.group for r in results):
        out.append(f"{group:<17} {counts_of([r for r in results if r.group == group])}")
    right, of = kinds_right(results)
    worse = [r.name for r in results + twins
             if r.ate_window == r.ate_window and r.ate > max(1.1 * r.ate_window,
                                                             r.ate_window + 0.005)]
    out.append(f"{len(results)} cases         {counts_of(results)}")
    out.append(f"kinds             {right} of {of} right in both variants")
    out.append(f"twins             {len(twins)}: {counts_of(twins)}")
    out.append(f"refined path worse than the window's by 10 % and 5 mm: {len(worse)}"
               + (" (" + ", ".join(worse) + ")" if worse else ""))
    out.append(f"CPU               {sum(r.seconds for r in results + twins):.0f} s")
    return "\n".join(out)


TEXT = """# Trials: spoiled inputs, and what the maps of them are

`scripts/trials` simulates small recordings (`lamina simulate`), spoils each in one way that users meet, maps it with
default settings and judges the map against the simulator's truth. Every kind has two variants; scene, noise and amounts are drawn
from a seed that no setting was tuned on. `scripts/trials --markdown` writes this page.

- The path is compared after the best yaw and translation, nothing else: a mirrored map does not pass.
- **Wrong**: ATE above twice that of the unspoiled twin plus 5 cm, or more than 5 % (and 20) of the cells wrong. Cells are compared
  with the simulator's true ground, in the same yaw and translation: an occupied cell more than {near:.0f} cm off a true wall or obstacle
  (with cameras: also deeper than {tops:.0f} cm inside one), a free cell more than {edge:.0f} cm outside the ground that the robot reaches; with cameras
  the same of the navigability grid, its blocked cells as a share of the seen ground. Wrong, too: poses for fewer than
  {kept:.0f} % of the frames and scans, for fewer than 99 % with no word of it, or other stamps than the recorded ones where those
  increase.
- **Said**: a warning of `metrics.json` whose id names what was spoiled, or exit 2 with a line that names it
  (the patterns stand beside each kind in `scripts/trials_lib/kinds_*.py`).
- Outcomes: right; said (wrong, but said); poor message (wrong or exit 2, and what is said names something else);
  silently wrong; hang ({cpu} s of work); broken promise (exit 1). A twin that warns of anything is a false alarm.
- ATE in m of either variant, `(twin)` behind it; where it is right a warning does not count.

"""


def cell(r):
    ate = f" {r.ate:.3f}" if r.ate == r.ate else ""
    return (f"**{r.outcome}**" if r.outcome not in (RIGHT, SAID) else r.outcome) + ate


def earlier(page):
    """The columns `before` of the page as it stands: they are kept."""
    out = {}
    for row in page.splitlines():
        fields = [f.strip() for f in row.strip().strip("|").split("|")]
        if row.startswith("| `") and len(fields) == 5:
            out[fields[0].strip("`")] = fields[2]
    return out


def markdown(results, twins, kinds, page):
    """The whole page; page: the one that it replaces."""
    from . import judge, trial
    before, by_kind = earlier(page), collections.defaultdict(list)
    for r in results:
        by_kind[r.name.rpartition(".")[0]].append(r)
    right, of = kinds_right(results)
    out = TEXT.format(near=100 * judge.NEAR, tops=100 * judge.TOPS,
                      edge=5 * judge.EDGE, kept=100 * judge.KEPT, cpu=trial.CPU_LIMIT)
    out += f"{len(results)} cases: {counts_of(results)}. Kinds right in both variants: {right} of {of}.\n"
    out += f"{len(twins)} twins: {counts_of(twins)}.\n\n"
    out += "| kind | what is spoiled | before | now | twin, m |\n|---|---|---|---|---|\n"
    group = ""
    for name, pair in by_kind.items():
        if kinds[name].group != group:
            group = kinds[name].group
            out += f"| **{group}** | | | {counts_of([r for r in results if r.group == group])} | |\n"
        now = ", ".join(cell(r) for r in pair)
        twin = ", ".join(f"{r.twin:.3f}" for r in pair)
        out += f"| `{name}` | {kinds[name].says} | {before.get(name, now)} | {now} | {twin} |\n"
    alarms = [f"- `{r.name}`: " + ", ".join(r.warnings) for r in twins if r.outcome != RIGHT]
    out += "\nWarnings of twins: " + ("none.\n" if not alarms else "\n\n" + "\n".join(alarms) + "\n")
    return out
