"""Words of the page of the random panels; lines in brackets become tables, names in braces numbers."""

TEXT = """# Random brick panels beside a paper

"Stochastic strength prediction of masonry structures: a methodological approach or a way forward?" draws the bricks
and joints of a brick panel with an opening at random: four sets, each with a draw for every brick and joint
("spatial") and with one draw for all ("non-spatial"), 300 runs each. Its Tables 2 to 4 are packaged as
`stochastic-brick-panels`.

Made by `python -m validation.stochastic --out docs/papers` from the lines in `examples/stored/stochastic_panels.csv`;
`--store FOLDER --runs 300 --workers 2` makes the runs, goes on where FOLDER ends, and folds them in.

**Ours: {runs}**, with sampling errors behind every value. The outline of the panel (787.5/8/4)
is inferred, not published; bricks are rigid and their compliance is lumped in the joints; joints lose cohesion and
tensile strength by opening, at once; 6,000 steps over 1.5 mm, local damping of 0.5, one speed; where the load is
largest at the end, a second run to 3 mm takes the first one's place. Strengths are linked joint by joint by c = 2 ft
tan(phi), ks = kn / 2.32.

## Ratios first

[ratios]

[cells]

{agreement}

{fallen}

- **One draw for all**: {slopes}. First
  order from the published log-slopes gives 22 % for linked strengths and 13 % for independent ones: the printed spread
  speaks for linked ones. Drawn each by itself, {independent}.
- **A draw for every joint** averages less here than published, and lowers the mean more, as of a panel whose weakest
  joints decide. The law of loss is why: see below.
- **Stiffness of joints** (set 3): the spatial spread is the larger one, as published.
- **Bricks** (set 2): see the noise floor.

![histograms, convergence, first crack beside failure](stochastic.png)

## The law of loss decides

The same draws of set 4, strengths alone, with joints that lose all, part and nothing, and by perfect plasticity:

[laws]

{brittleness} At psi = 0 the
smallest load is searched, not proven: what the search misses is in that spread.

The source says two things of its law: section 3 sets friction and cohesion "to their residual values" once the
strength is passed and names no values, section 5 has the "elastic-perfectly plastic" slip model. Loads of joints that
keep something still rise at 1.5 mm ({kept_rise}): loads there, not maxima.

## Why the mean set gives {mean_set} kN where the paper has 4.71

Runs of a case differ in the friction angle by parts in a million.

[mean set]

- **Law of loss**: it spans the published value by itself; cohesion that stays, which is what "elastic-perfectly
  plastic" says, comes nearest.
- **Outline and bond**: tens of per cent, either way; with cohesion kept, the outlines span the published value too.
- **Speed**: 2 to 4 %, downwards, as for the draws below. **Damping**: some. The source has a viscous one that falls
  with the motion. At a ninth of the speed, two runs each, local damping of 0.5 and 0.8 gives 3.63 and 3.67 kN, combined
  damping of 0.8 gives 3.58, combined damping of 0.5, the default of `dem.push`, 3.09 and a longer plateau. Drops before
  the peak set free up to 0.5 of the work as motion with local damping of 0.5 and 0.004 with combined damping: what
  follows a drop is another branch of the brittle sequence, and calm runs differ by 14 % too.
- **ks / kn**: the peak grows with it. The printed ks = 5.9 GPa/m is not kn / 2.32 = 5.82; that difference is in the
  noise.
- **Bricks** that strain and bend (simply deformable) give the same: 3.78 for 3.75 kN, within the scatter of three runs.

Neither law nor outline is published: the gap can be covered, not attributed.

## What a single run is worth

The noise of a run: two runs of the same draw whose strengths differ by a part in a million. Of the mean set, {floor}
at this speed and {third} at a third of it.

[floor]

{judged}

{slower}

{repeated}

## First crack

0.15 mm, beside failure. "Under own weight": runs in which a joint reaches its strength before the panel is pushed.

[cracks]

The tests cracked at 0.72 to 1.71 kN; ours crack below, as the paper says of its own. It finds no correlation with the
peak; the intervals say what ours can.

## Modes

By the rule of `dem.failure_mode`. The names are not those of the paper's five pictures. "Movement without mirror
image" is the part of opening and slip at the peak, by volume, that the opposite joint does not share: 0 of a
symmetric mechanism, 1 of one side alone; a run is asymmetric from {alone} on.

[modes]

The paper: all spatial runs asymmetric, non-spatial ones expected symmetric. {symmetry}

## Convergence

Mean and CoV after so many runs.

[convergence]

A CoV of 300 runs has a sampling error of 4 % of itself, of 24 runs 14 %.{settled}

## Time

{time}

[pace]

{repeats}
"""

TIME = """\
0.65 s of processor time for the panel of mean values, 1.0 s for a run as drawn, some of which go on to 3 mm (published:
48 hours for 300). Two workers on two cores with nothing else to do made 87 runs a minute: 300 runs take
3.5 minutes, 2,400 half an hour. Of this page, 1,219 runs in a row came at 33 a minute (4 to 58 from minute to minute)
from two workers on two cores that had a load of 12 to 23: 300 in 9 minutes, 2,400 in 73.

How time grows, by `python -m validation.stochastic.pace 6,12 1 2 dask2` on two cores that other work loaded as stated,
at a lower priority than some of it: processor time grows with the runs and not with the workers, a local dask cluster
adds its own; the wall clock says what was left of the machine, not what two cores can do."""

REPEATS = """\
The same three runs come out to the bit with one worker, with two, and on a local dask cluster of two; a study of six
that was killed by SIGKILL after three went on with its file, left the three lines as they were, and equals the one of
two workers."""

REPEATED = """\
Equal input gives equal runs on one machine with one version. Sums added in another order, as by a later version or
another processor, are another run of the same draw: peaks then move as in the table above, by some per cent, while all
that is elastic keeps its digits. The lines of this page were made by two versions whose runs are the same to the
bit."""
