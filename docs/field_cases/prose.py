"""The text of docs/explanation/validation.md; most figures of models are inserted by the modules `page_*`."""

HEAD = """# Validation: simulated rocks against rocks that fell
After this page you know how far to trust a predicted runout: it compares simulated rocks with rocks that fell at three
sites.

On this page a *block* is a real rock of a field test, and a *rock* is simulated. Three models are compared: `constant`
and `coulomb_limited`, in which a rock is a point, and the rigid sphere ([physics](physics.md)).
[Rocks with a shape](#rocks-with-a-shape) have a section of their own.
"""

VERDICT = """**No, not on a slope where the model was not calibrated.** Calibrate on rocks that fell on the slope in
question, or use the result only to compare variants.

- **Coefficients from books give no reliable prediction.** The mean runout is wrong by {book_low:+.0f} to
  {book_high:+.0f} m at Authume and by {meadow_low:+.0f} to {meadow_high:+.0f} m at Tschamut. Another open program,
  without calibration, is wrong by {bar:+.0f} m at Tschamut. At Authume the Coulomb-limited model with Hoek's values is
  wrong by only {lucky:+.0f} m, but half of its rocks stop on the upper slope and none on the ledge. With values from
  books, rocks go farther in this model than in the constant model.
- **After calibration at Authume, each model of a point or a sphere agrees in the mean, but not in the spread.** The
  mean differs from the field by at most {off:.1f} m. The standard deviation is {sd_low:.1f} to {sd_high:.1f} m along
  the profile (field: {field_sd:.1f} m) and {side_low:.1f} to {side_high:.1f} m across it (field: {field_side:.1f} m).
  Real blocks have shapes that spread them; a point or a sphere has none.
- **Rocks with a shape spread as far as the blocks at Authume, but are no better from site to site.** With three
  numbers calibrated on x alone, the standard deviation is {shaped_sd:.1f} m along and {shaped_side:.1f} m across the
  profile, and {shaped_beyond:.0f} % pass 55 m (field: {field_beyond:.0f} %). The same numbers are wrong by
  {shaped_meadow:+.0f} m at Tschamut; Tschamut's are wrong by {shaped_quarry:+.0f} m at Authume.
- **Calibrated values are not properties of the ground.** The constant model's friction angles at Authume are too low
  for a rock slope, because sliding replaces rolling in this model.
- **At Tschamut the calibrated models look better than they are**: see *Where it fails* in
  [that section](#tschamut-2014).
- **Values from one slope are not valid on another.** Values from Authume are wrong by {at_meadow} m at Tschamut
  (constant, Coulomb-limited, rigid sphere). Values from Tschamut are wrong by {at_quarry} m at Authume. Values from
  single impacts are wrong by {impacts_quarry} m at Authume and by {impacts_meadow} m at Tschamut.
- **Ranges say what values hide.** With ranges of the library in place of values, and before any calibration, 90 %
  intervals hold {held_quarry} of 41 stops along the slope at Authume and {held_meadow} of 18 at Tschamut. Many of these
  intervals have no far end. Across the slope they hold as few as {held_across}: points and spheres spread too little. A
  calibration on another slope holds as few as none
  ([predictive intervals](#do-predictive-intervals-hold-the-observed-stops)).
- **Small changes matter.** At Authume the mean moves by more than five metres if R_n (constant) or rolling friction
  (sphere) changes by 0.04, and by more than eight metres if the friction angle changes by four degrees
  (Coulomb-limited).
"""

METHOD = """## How are field and simulation compared?
`make validation` (`docs/validation.py`) calibrates, measures and writes this page. `python docs/validation.py --as-is`
writes the page from the last measurement.

- **Models**: `constant` and `coulomb_limited` with `ground: sliding`; the rigid sphere is `rock.shape: sphere` with
  `ground: sphere`. Every scene of this page names its rebound and its ground.
- **Uncalibrated**: published values for ground with the same description, chosen without knowledge of the end points.
  Two libraries show how much two books differ.
- **Calibrated**: one set of parameters for the whole site. The search tries a grid of values, then two finer grids
  around the best set, each with half the step. All sets fly the same rocks (seed 1): 2,000 at Authume (500 spheres,
  which take longer), 900 at Tschamut. The figures of this page come from other rocks (seed 2): 10,000 and 9,000.
- **Kept out**: the search uses one half of a site's data, and the other half checks the result. This shows whether the
  search only fits single blocks.
- **One basis**: the same functions evaluate field and simulation. Distances start at the field's start (the mean drop
  point at Authume, the run's release at Tschamut), also for rocks that are released next to it.
- **Intervals** are 95 %, for the *field's* few blocks: Wilson's for shares, bootstrap percentiles for all other
  figures. The intervals of 10,000 simulated rocks are a sixteenth as wide and not shown.
- **Angles** are in degrees. *Correlation over runs* is the correlation of simulated and observed runouts.
"""

DEFAULT = """## Why is `coulomb_limited` the default, and where is it weaker than `constant`?
`coulomb_limited` is the default because of its mechanics: no impact takes more speed along the ground than friction
can. `constant` takes a share at each of infinitely many impacts. So no speed is left when bouncing ends, on any
slope, and the runout is too short: the unsafe side ([the end of bouncing](physics.md#the-end-of-bouncing)). **The
field data do not show which of the two is better.** Neither predicts the runout on a slope where it was not
calibrated.

`coulomb_limited` is **nearer** to the field in these figures:

- Tschamut, calibrated on all runs: all figures except the spreads;
- Authume, calibrated, along the profile: standard deviation, 95th percentile, and by a little the distance of x;
- with the books' values: three cases of four;
- Chant Sura: the six impacts, with values calibrated on the eleven contacts (with the books' values the two models are
  about equal);
- calibrated friction angles: 20 to 30 degrees on all data and on each half, which is possible for real ground. Those of
  `constant` are 5 to 30.

`coulomb_limited` is **farther** from the field in these figures:

- lateral spread, calibrated at Authume and at Tschamut;
- values from Authume used at Tschamut, and the reverse. Here its error can be much larger.

There is **no clear difference** in these figures:

- speeds after the eleven contacts;
- kept-out halves. `constant` is nearer in four of six figures, in all but one of them (a lateral figure) by about half
  a metre or less; `coulomb_limited` is much nearer in one. Halves of 9 and 8 runs are small, and the result depends on
  the grid: with R_t searched from 0.35 to 0.95 the errors on Tschamut's second half are 19.8 m (`constant`) and 11.5 m,
  and `coulomb_limited` is nearer in four of six.
"""

GRIDS = """## Which values does the calibration try?
`constant` and `coulomb_limited` have the same grids, rocks and ground; only the rebound differs. In `coulomb_limited`
the friction angle also limits the loss of speed at an impact. With single impacts (Chant Sura) the calibration varies
two coefficients and the slope of the ground; the friction angle keeps its published value. The friction angle of the
sphere is always 35 degrees (Newcastle open-pit library).
"""

CURVES = """\
In another program for a lumped mass, with another rule for the end of bouncing, the same step moved the mean by 38 m:
this rule is as important as a coefficient.
"""

SENSITIVITY = """### What do a few hundredths of a coefficient change?
Mean x of end points (m), if one parameter has five values (in brackets) around its calibrated value:
"""

AUTHUME_FAILS = """\
**Where it fails.**
- No calibrated model leaves a rock on the upper slope, where 2 of 41 blocks stopped. No calibrated point passes 59 m,
  as 5 of 41 blocks did.
- In all three models the spread across the profile is too small, so their hazard maps are too narrow.
- In every model, values from one half of the blocks predict the other half worse than their own half.
- The calibrated R_t of the Coulomb-limited model is at its lower bound, because R_t has little effect where friction
  limits the loss. A search with R_t of at least 0.35 ends at 0.35, with a distance of 4.1 m in x and a lateral spread
  of 2.5 m.
"""

TSCHAMUT_FAILS = """\
**Where it fails.**
- In all calibrated models the rocks of the two shortest runs (31 and 46 m) go tens of metres too far. A mean error of a
  few metres hides this.
- `constant`: the friction angle is at the edge of the searched range, and R_n has no effect: very different values fit
  all runs equally well. The model does not distinguish long runs from short runs: all rocks reach the flat step at the
  foot of the terrain.
- `coulomb_limited` fits best and distinguishes long runs from short runs a little. R_n is at the edge of the searched
  range.
- The rigid sphere is worse than `constant`: some rocks hardly leave their release, others reach the foot of the slope.
- The runouts of the two point models have too little spread. Those of the sphere have more spread than the field, but
  are not long where the field's runouts are long.
"""

AUTHUME = """## Authume quarry, profile P1
In an open pit in France, a power shovel dropped 41 blocks of 178 to 1,751 kg. The terrain has 9,001 triangles in three
zones (`config/scenes/authume_p1.yaml`). x is the direction along the profile, z the lateral direction.

- Simulated rocks are dropped up to 1 m from each of the four drop points and have the blocks' mean mass. The spread of
  the drop points is part of both lateral spreads.
- The field's end points are 2.87 m above the mesh, because the two have different height references. Simulated end
  points are raised by 2.87 m, which changes only the reach angle (the slope from start to end).
- The calibration uses only x of the end points. Lateral spread and reach angle are therefore an independent check of
  every row.

Calibrated values (distance from the field's x in m; number of sets tried):
"""

CHECKS = "Checks: mean x 44.1 ± 5 m; ledge 51 ± 15 points; floor 44 ± 15 points.\n"

TSCHAMUT = """## Tschamut 2014
The data are 18 runs of blocks of 40 to 79 kg on an alpine meadow. Run v034 repeats v033 to the last digit, so the
calibration uses 17 runs; means use 18.

- The terrain is not a survey but an approximation in cells of 5 m: a plane with interpolated deviations. Differences of
  some metres have no meaning.
- The rocks of a run start within 0.5 m of its release, with its velocity, one block's size above the ground and with
  the mean mass of all blocks.
- The lateral direction is across the line from the mean release to the mean end point of the field.
- For comparison, the first table has another open program, without calibration, on a survey of 2 m (a point mass and a
  sphere).

Calibrated values (mean absolute error of runout in m; number of sets tried):
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
- The energy ratios of the six impacts differ by a factor of five, those of a model by far less: a flat block lands on a
  face, an edge or a corner, and none of these models distinguishes them.
- The eleven contacts are steep and slow, the six impacts flat and fast. So values calibrated on the eleven are of
  little use for the six. Constant coefficients cannot be right for both.
"""

TRANSFER = """## From site to site
The table uses values calibrated on all data of one site at all three sites; *the site of the calibration is in
italics*. Single impacts cannot calibrate the friction on the ground, so there it has the published value of the
simulated site. The sphere's rolling friction is almost the same at Authume and Tschamut. So its values from one site
are about as good at the other site.
"""

NOT_VALIDATED = """## What does this page not show?
- There are three sites, two of them meadows, with 41 + 18 blocks and 17 impacts. Intervals are wide. By chance,
  values from one site can look good or bad at another.
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
