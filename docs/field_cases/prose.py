"""The text of docs/explanation/validation.md; most figures of models are inserted by the modules `page_*`."""

HEAD = """# Validation: simulated rocks against rocks that fell
After this page you know how far to trust a predicted runout: it compares simulated rocks with rocks that fell at three
sites.

On this page a *block* is a real rock of a field test, and a *rock* is simulated. Four models are compared: `constant`
and `coulomb_limited`, in which a rock is a point, the rigid sphere, and [rocks with a shape](#rocks-with-a-shape)
([physics](physics.md)).
"""

VERDICT = """**No, not on a slope where the model was not calibrated.** Calibrate on rocks that fell on the slope in
question. If none did, use ranges, and take the wide intervals at their word.

- **Coefficients from books give no reliable prediction.** With points and spheres, the mean is wrong by
  {book_low:+.0f} to {book_high:+.0f} m at Authume and by {meadow_low:+.0f} to {meadow_high:+.0f} m at Tschamut.
  Another open program, without calibration, is wrong by {bar:+.0f} m (point) and {bar_sphere:+.0f} m (sphere) at
  Tschamut.
- **After calibration, points and spheres hold too few stops across the slope.** At Authume their lateral standard
  deviation is {side_low:.1f} to {side_high:.1f} m (field: {field_side:.1f} m), and 90 % intervals hold only
  {across_quarry_low} to {across_quarry_high} of the 41 kept-out blocks across the slope. Real blocks have shapes that
  spread them; a point or a sphere has none.
- **Rocks with a shape spread as the blocks do at Authume.** Their lateral standard deviation is {shaped_side:.1f} m,
  and 90 % intervals hold {shaped_along_quarry} kept-out blocks along the slope and {shaped_across_quarry} across. At
  Tschamut, intervals hold {shaped_along_meadow} stops along and {shaped_across_meadow} across; the spread along the
  slope is too large there ({meadow_along:.0f} m, field: {field_along:.0f} m).
- **The predictive intervals of a calibrated run hold the misfit of the model, and are wide enough with it**, except for
  `constant` along the slope at Tschamut. There the misfit of points and spheres is as large as the spread of the stops
  themselves: such intervals repeat the field and predict nothing.
- **Stops alone say little about the ground.** At Tschamut most coefficients stay nearly as uncertain as before. No
  model predicts kept-out stops clearly better than a curve without any physics; rocks with a shape at Authume are
  better by {gain:.2f} ± {doubt:.2f} (mean log density).
- **Values from one slope may be far too sure on another.** Calibrated at Authume, the models are wrong by {at_meadow} m
  at Tschamut (constant, Coulomb-limited, rigid sphere, rocks with a shape), and 90 % intervals hold {held_at_meadow} of
  18 stops. Calibrated at Tschamut, they are wrong by {at_quarry} m at Authume and hold {held_at_quarry} of 41. Values
  from single impacts are wrong by {impacts_quarry} m at Authume and by {impacts_meadow} m at Tschamut.
- **Ranges of the library hold most stops before any calibration**: {library_quarry} of 41 along the slope at Authume
  and {library_meadow} of 18 at Tschamut. Most of these intervals have no far end. Across the slope they hold as few
  as {library_across} ([predictive intervals](#do-predictive-intervals-hold-the-observed-stops)).
"""

METHOD = """## How are field and simulation compared?
`make validation` (`docs/validation.py`) calibrates, measures and writes this page. `python docs/validation.py --as-is`
writes the page from the last measurement.

- **Models**: `constant` and `coulomb_limited` with `ground: sliding`; the rigid sphere is `rock.shape: sphere` with
  `ground: sphere`; rocks with a shape have `contact: rigid`.
- **Published values**: for ground with the same description, chosen without knowledge of the end points. Two libraries
  show how much two books differ. 10,000 rocks at Authume and 9,000 at Tschamut fly with one value for each coefficient.
- **Calibrated**: the sample of `rpf3d calibrate`, one value for the whole site, with a budget of one hour.
  `python docs/field_cases/scenes.py FOLDER` writes the scenes. 64 sets of the sample fly over the slope that they were
  calibrated on, 200 rocks each at Authume and 216 at Tschamut (rocks with a shape: about 72, those of the shape of
  their run's block). These lines show how well a model can fit, not how well it predicts.
- **Kept-out stops** show how well it predicts: the calibration keeps each fold of the stops out in turn and predicts it
  from the others. The *score* is the mean logarithm of the predicted density at each stop; higher is better. The
  *curve* is a normal distribution without physics. With the *misfit*, intervals also hold the error of the model that
  the calibration found; the largest misfit that it tries is the spread of the stops.
- **Held** by a 90 % interval is a stop if 5 to 95 % of the predicted rocks stop before it, along or across the slope.
  A calibration smooths its rocks and leaves those out that did not stop. All other tables count them as beyond every
  stop along the slope. So the counts of two kinds of tables differ a little.
- **One basis**: the same functions evaluate field and simulation. Distances start at the field's start (the mean drop
  point at Authume, the run's release at Tschamut), also for rocks that are released next to it. A rock that left the
  terrain ends at the boundary, which is nearer than it would have gone.
- **Brackets**: in a line of the field or of published values, the 95 % interval that the *field's* few blocks leave
  (bootstrap percentiles). In a line of calibrated values or ranges, 5 to 95 % of the parameter sets, each flown alone:
  this holds the chance of the rocks of one set, but not that of the field's blocks.
- **Narrower by** is 1 minus the standard deviation of a calibrated coefficient over that of its prior. Below 15 %
  (in **bold**) the stops hardly determine the coefficient; below 0 the calibration is wider than the prior.
- **Angles** are in degrees. *Correlation over runs* is the correlation of simulated and observed runouts.
"""

COEFFICIENTS = "Calibrated coefficients:\n"

SCORES = "Kept-out stops:\n"

AUTHUME = """## Authume quarry, profile P1
In an open pit in France, a power shovel dropped 41 blocks of 178 to 1,751 kg. The terrain has 9,001 triangles in three
zones (`config/scenes/authume_p1.yaml`). x is the direction along the profile, z the lateral direction.

- Simulated rocks are dropped up to 1 m to each side of each of the four drop points. Points and spheres have the
  blocks' mean mass; rocks with a shape have the shapes and sizes of four scanned blocks. The spread of the drop
  points is part of all lateral spreads.
- The field's end points are 2.87 m above the mesh, because the two have different height references. Simulated end
  points are raised by 2.87 m.
"""

TSCHAMUT = """## Tschamut 2014
The data are 18 runs of blocks of 40 to 79 kg on an alpine meadow. Run v034 repeats v033 to the last digit. All 18 are
used, so this stop counts twice in the calibration, and may predict its copy.

- The terrain is not a survey but an approximation in cells of 5 m: a plane with interpolated deviations. Differences of
  some metres have no meaning.
- The rocks of a run start within 0.5 m to each side of its release, with its velocity. Points and spheres start one
  block's size above the ground, with the mean mass of all blocks. Rocks with a shape start three radii above it, with
  the mass and the three lengths of the run's block (an ideal equant body, stretched).
- The lateral direction is across the line from the mean release to the mean end point of the field.
- For comparison, the table has another open program, without calibration, on a survey of 2 m (a point mass and a
  sphere).
"""

OWN_RELEASE = """In this table each stop is compared with the rocks of its own run, whose release is known. The
calibration does not know which release a stop belongs to, so its intervals of kept-out stops are often wider.
"""

AUTHUME_FAILS = """**Where it fails.**
- Points and spheres hold at most 25 of 41 kept-out blocks across the slope, and `coulomb_limited` only 27 along. The
  misfit, 4 to 6 m, mends most of this: what is missing is in the model, not in its coefficients.
- Only combinations of coefficients are determined: R_n and R_t correlate at {constant:.2f} (`constant`) and
  {limited:.2f} (`coulomb_limited`), {pair} of the sphere at {sphere:.2f}.
- The friction angle of `constant` is at the lower end of its range, too low for a rock slope: no speed is left when
  bouncing ends, and only on slippery ground do its rocks slide on. R_n of `coulomb_limited` is at the lower end of its
  range.
- Of the calibrated models, only `coulomb_limited` is farther in x from the blocks than chance explains.
- No model predicts kept-out blocks better than a curve without physics by two standard errors.
"""

TSCHAMUT_FAILS = """**Where it fails.**
- The seven runs that were released in the east, near (59, 258), are the ones that no model follows. There the
  approximated terrain is gentler, and up to half of the rocks of a model stop within 10 m of their release, as no block
  did. At the other eleven runs, all calibrated models but `constant` are wrong by 6 m or less in the mean. These data
  do not show whether the terrain or the models are the reason.
- With the known release of each run, points and spheres hold 0 to 7 of 18 stops along the slope and 1 or 2 across.
- No calibrated model distinguishes long runs from short runs: the correlation over runs is within 0.25 of zero (by
  chance, within 0.47).
- `constant` cannot fit: its friction angle is at the lower end of its range, its mean runout is 26 to 29 m too short
  and hardly differs between runs, and its intervals hold no kept-out stop along the slope.
- The restitutions of points and spheres, and all three numbers of rocks with a shape, are hardly determined.
- No model predicts kept-out stops better than a curve without physics by two standard errors.
"""

DEFAULT = """## Why is `coulomb_limited` the default, and where is it weaker than `constant`?
`coulomb_limited` is the default because of its mechanics: no impact takes more speed along the ground than friction
can. `constant` takes a share at each of infinitely many impacts. So no speed is left when bouncing ends, on any
slope, and unless the ground is slippery the runout is too short: the unsafe side
([the end of bouncing](physics.md#the-end-of-bouncing)). The field data alone do not decide between the two.

`coulomb_limited` is **better** in these figures:

- the score of kept-out stops at Tschamut, where `constant` holds none along the slope; at Authume the scores are equal;
- friction angles that real ground can have on both slopes. Those of `constant` are at the lower end of their range;
- the mean runout at Tschamut, calibrated there.

It is **worse** in these figures:

- the spreads at Authume along and across the slope, the distance in x, and the kept-out blocks that its intervals hold;
- R_n at Authume, which is at the lower end of its range;
- values of one slope on the other. With values from Tschamut, nearly half of its rocks do not stop in the quarry at
  Authume.

At Chant Sura each is nearer to the six impacts once: `constant` with published values, `coulomb_limited` with values
that are calibrated on the eleven contacts.
"""

CHANT_SURA = """## Chant Sura
The data are single impacts on an alpine meadow, without trajectories. The models predict the speed after an impact from
the velocity before it. Energy is translational.

- **Six impacts** of a block of 780 kg, with speeds along and into the ground. These two speeds come from the height of
  the jump, not from a survey.
- **Eleven contacts** of five other runs, of 210, 250 and 780 kg, with velocities before and after, but without the
  slope. After six of them the block moves downwards, so the ground is not level. The tables assume slopes of 0, 15 and
  30 degrees, falling in the direction of motion. In the calibration the slope is one more parameter.
- **The spin before an impact is unknown.** It is taken as 0 and, for the six impacts, also as 27 rad/s forwards: the
  mean of four values of Lu et al. 2019 for such a block. A point has no spin.

**Where it fails.**
- In one of the six impacts the translational energy is larger after the impact than before (1.11), because spin turned
  into speed. A model that never adds energy and starts without spin cannot show this.
- The energy ratios of the six impacts differ by a factor of five, those of a model by a factor of {widest:.1f} or
  less: a flat block lands on a face, an edge or a corner, and none of these models distinguishes them.
- The eleven contacts are steep and slow, the six impacts flat and fast. Values of `constant` that are calibrated on the
  eleven leave the six far too little energy.
"""

NOT_VALIDATED = """## What does this page not show?
- There are three sites, two of them meadows, with 41 + 18 blocks and 17 impacts. Intervals are wide. By chance,
  values from one site can look good or bad at another.
- Whether the difference between two designs is right was not measured.
- Only end points and single impacts are compared, not the figures for the design of barriers: bounce heights, speeds
  and energies along the path.
- All points and spheres of a site have the same mass, and coefficients do not vary from impact to impact.
  Distributions in the scene (`normal_restitution: {mean: ...}`), `effects` and the real masses may give better results;
  this was not measured.
- Calibrated values are valid only with rpf3d's rules for the end of bouncing and for sliding ([physics](physics.md)).
  In another program or model they have another meaning.
"""

SOURCES_OF_DATA = """## Where does the data come from?
The data is not part of this project. Put the folders into `shared/data`, next to the project's own folder.

| site | data | literature |
| --- | --- | --- |
| Authume | `authume/`: DTM_Blue_zone.stl, DTM_Gray_zone.stl, DTM_Red_zone.stl, positions_P1.xyz, Endpoints_P1.txt \
and, in `authume/blocks/`, SP1A.stl, SP2A.stl, SP2B.stl, SP3A.stl \
of richefeu/AuthumeQuarryRockfalls_Data-in-Brief (2025) | Garcia, Villard, Richefeu, Daudon, Comparison of \
full-scale rockfall tests with 3D complex-shaped DEM simulations, Eng. Geol.; Bourrier et al. 2021, Landslides \
18:639-654 |
| Tschamut 2014 | `tschamut2014/`: release_points.csv, observed_deposition.csv, block_metadata.csv, \
terrain.asc, from EnviDat \
doi:10.16904/envidat.34 (ODbL, DbCL), as tabulated in ofuhrer/rust_rockfall | Volkwein & Gerber 2018, Geosciences \
8(3):88 |
| Chant Sura | `chant_sura/`: observed_contact_events_extended.csv, esurf2019_impacts.csv, rock_shapes.csv, \
from EnviDat \
doi:10.16904/envidat.174, as tabulated in ofuhrer/rust_rockfall | Caviezel et al. 2019, ESurf 7:199 (CC BY 4.0); Lu \
et al. 2019, Landslides 16:2353 |
"""
