"""Texts of docs/explanation/validation.md; the modules `page_*` insert most figures of models."""

HEAD = """# Validation: simulated rocks against rocks that fell
This page explains how far you can trust a predicted runout. It compares simulated rocks with rocks that fell in field
tests at three sites.

On this page a *block* is a real rock of a field test, and a *rock* is simulated. A *stop* is the place where a block
stopped. The page compares four [models](physics.md): `constant` and `coulomb_limited`, in which a rock is a point; the
rigid sphere; and [rocks with a shape](#rocks-with-a-shape). For the single impacts at
Chant Sura, it also compares the other rebound models.
"""

VERDICT = """**No, not on a slope where the model was not calibrated.** Calibrate on rocks that fell on your slope. If
no rocks fell there, use ranges for the coefficients, and accept wide intervals.

- **Coefficients from books give no reliable prediction.** With points and spheres, the error of the mean runout
  (at Authume: of the mean x, along the profile) is {book_low:+.0f} to {book_high:+.0f} m at Authume (field: 44 m) and
  {meadow_low:+.0f} to {meadow_high:+.0f} m at Tschamut (field: 92 m). At Tschamut, the error of another open program,
  without calibration, is {bar:+.0f} m (point) and {bar_sphere:+.0f} m (sphere).
- **After calibration, the intervals of points and spheres contain too few stops across the slope.** At Authume the
  lateral standard deviation of their rocks is {side_low:.1f} to {side_high:.1f} m (field: {field_side:.1f} m). Across
  the slope, 90 % intervals contain only {across_quarry_low} to {across_quarry_high} of the 41 stops that were kept out
  of the calibration. Real blocks spread because of their shapes, which points and spheres do not have.
- **Rocks with a shape spread as the blocks do at Authume.** Their lateral standard deviation is {shaped_side:.1f} m.
  The 90 % intervals contain {shaped_along_quarry} kept-out stops along the slope and {shaped_across_quarry} across. At
  Tschamut, the intervals contain {shaped_along_meadow} stops along, where 16 are expected (with two other seeds: 16
  and 14), and {shaped_across_meadow} across. The spread along the slope is too large there
  ({meadow_along:.0f} m, field: {field_along:.0f} m).
- **Intervals that include the misfit of the model are wide enough.** A run with a calibrated scene gives such
  intervals. They contain at least 80 % of the kept-out stops, except for `constant` along the slope at Tschamut. But at
  Tschamut the misfit of points and spheres is as large as the spread of the stops: such intervals repeat the spread of
  the field and predict nothing.
- **No model predicts kept-out stops clearly better than a curve without physics**: no model is better by two standard
  errors. The best model, rocks with a shape at Authume, is better than the curve by {gain:.2f} ± {doubt:.2f} (mean log
  density).
- **Stops alone contain little information about the ground.** At Tschamut most coefficients stay nearly as uncertain as
  before the calibration.
- **A calibration on one slope may give far too narrow intervals on another slope.** The four figures are for
  `constant`, `coulomb_limited`, the rigid sphere and rocks with a shape, in this order. Calibrated at Authume, the
  models have errors of {at_meadow} m at Tschamut, and their 90 % intervals along the slope contain {held_at_meadow} of
  18 stops. Calibrated at Tschamut, the models have errors of {at_quarry} m at Authume, and their intervals contain
  {held_at_quarry} of 41 stops.
- **Values from single impacts give no reliable prediction either.** With these values, the errors of the first three of
  these models are {impacts_quarry} m at Authume and {impacts_meadow} m at Tschamut.
- **With ranges of rpf3d's library of ground, intervals along the slope contain most stops before any calibration**:
  {library_quarry} of 41 at Authume and {library_meadow} of 18 at Tschamut, depending on the model. But most of these
  intervals [have no far end](#do-predicted-intervals-contain-the-observed-stops). Across the slope they contain as few
  as {library_across}.
"""

METHOD = """## How are field and simulation compared?
`make validation` (`docs/validation.py`) calibrates, measures and writes this page. `python docs/validation.py --as-is`
writes the page from the last measurement.

- **Models**: `constant` and `coulomb_limited` with `ground: sliding`; the rigid sphere is `rock.shape: sphere` with
  `ground: sphere`, and its rebound model is `coulomb_sphere`; rocks with a shape have `contact: rigid`.
- **Published values** come from [two libraries](#which-published-values-are-used). They are values for ground with the
  same description, and were chosen without knowledge of the stops. 10,000 rocks at Authume and 9,000 at Tschamut fly
  with one value for each coefficient.
- **Calibrated** is a sample of parameter sets from `rpf3d calibrate`, with one value of each coefficient for the whole
  site, and at most one hour for each calibration. `python docs/field_cases/scenes.py FOLDER` writes the scenes. 64 sets
  of the sample fly over the slope of their calibration, with 200 rocks each at Authume and 216 at Tschamut. (At
  Tschamut, only about 72 of the 216 rocks with a shape count: those with the shape of the block of their run.) The rows
  *calibrated* show how well a model can fit, not how well it predicts.
- **Kept-out stops** show how well a model predicts. The stops are divided into groups (folds), and each group is
  predicted from a calibration with the other groups. The *score* is the mean logarithm of the predicted density at each
  stop; higher is better. The *curve* is a normal distribution without physics.
- **Misfit** is the error of the model that the calibration found, a standard deviation (m). The calibration tries
  misfits up to the spread of the stops. Intervals *with the misfit* include this error.
- **Contained**: a 90 % interval contains a stop if 5 to 95 % of the predicted rocks stop before this stop, along or
  across the slope. In tables of kept-out stops, the intervals come from a smoothed distribution of the simulated stops,
  without the rocks that did not stop. All other tables count rocks that did not stop as beyond every stop along the
  slope, so their counts differ a little. At Tschamut the counts differ more, for a [second reason](#tschamut-2014).
- **One basis**: the same functions evaluate field and simulation. All distances start at the mean drop point
  (Authume) or at the run's release (Tschamut), also for rocks that are released next to this place. For a rock that
  left the terrain, the distance to the boundary counts, although the rock would have gone farther.
- **Brackets**: in a row of the field or of published values, the brackets show the 95 % interval that follows from the
  small number of blocks (bootstrap percentiles). In a row of calibrated values or ranges, the brackets show the 5th and
  the 95th percentile of the results of the single parameter sets. These percentiles include chance among the rocks of
  one set, but not chance among the blocks.
- **Narrower by** compares a calibrated coefficient with its prior: 1 minus the ratio of their standard deviations.
  Below 15 % (in **bold**) the stops hardly determine the coefficient. Below 0 the calibrated coefficient is less
  certain than its prior.
- **Scores** have four columns: the calibrated model for kept-out stops, the model with its *prior*, the model with
  published values (*books*; empty if none were compared) and the *curve*. The [glossary](../reference/glossary.md)
  explains *effective samples*.
- **Other columns**: *sd* is the standard deviation, *rms* the root mean square; *p5* to *p95* are percentiles. *Not at
  rest* is the share of rocks that did not stop. *Correlation over runs* is the correlation of simulated and observed
  runouts. *Error of velocity* is the root mean square length of the vector difference between simulated and observed
  velocity, so it includes wrong directions. Angles are in degrees.
"""

COEFFICIENTS = "Calibrated coefficients:\n"

SCORES = "Kept-out stops:\n"

AUTHUME = """## Authume quarry, profile P1
In an open pit in France, a power shovel dropped 41 blocks of 178 to 1,751 kg. The terrain has 9,001 triangles in three
zones (`config/scenes/authume_p1.yaml`). In the data, x is the direction along the profile, y points up, and z is the
lateral direction.

- Simulated rocks are dropped up to 1 m to each side of each of the four drop points. Points and spheres have the
  blocks' mean mass; rocks with a shape have the shapes and sizes of four scanned blocks. All lateral spreads include
  the spread of the drop points.
- Simulated end points are raised by 2.87 m, because the heights of the stops have a different reference and are 2.87 m
  above the mesh.
"""

TSCHAMUT = """## Tschamut 2014
The data are 18 runs of blocks of 40 to 79 kg on an alpine meadow. In the data, the runs v033 and v034 are equal to the
last digit. All 18 runs are used, so the stop of these two runs counts twice in the calibration, and one copy may
predict the other.

- The terrain is not a survey but an approximation in cells of 5 m: a plane with interpolated deviations. Differences of
  some metres have no meaning.
- The rocks of a run start within 0.5 m to each side of the run's release, with the velocity of the release. Points and
  spheres start one block's size above the ground, with the mean mass of all blocks. Rocks with a shape start three
  radii above the ground. They have the mass and the three lengths of the run's block (the shape is an ideal equant
  block, stretched to these lengths).
- The lateral direction is across the line from the mean release to the mean stop.
- For comparison, the table has the results of another open program, without calibration, on a survey with cells of 2 m
  (with a point mass and with a sphere).
"""

OWN_RELEASE = """The *error of runout* is the simulated minus the observed runout. This table compares each stop with
the simulated rocks that start at the release of the same run. The calibration does not know from which release a stop
comes. So the calibration compares each stop also with rocks from other releases, and the intervals in the table
*Kept-out stops* below are often wider.
"""

AUTHUME_FAILS = """**Where the models fail.**
- The intervals of points and spheres contain at most 25 of 41 kept-out stops across the slope, and the intervals of
  `coulomb_limited` only 27 along. With the misfit of 4 to 6 m, the intervals contain most stops: the error is in the
  model, not in the coefficients.
- The calibrated sphere has too little spread in x, and less than half of the field's spread across the slope.
- The stops determine only combinations of coefficients. The correlation of R_n and R_t is {constant:.2f} (`constant`)
  and {limited:.2f} (`coulomb_limited`); the correlation of {pair} of the sphere is {sphere:.2f}.
- The friction angle of `constant` is at the lower end of its range, and too low for a rock slope. The reason: with
  `constant` no speed is left when bouncing ends, so rocks slide on only if the ground is slippery. R_n of
  `coulomb_limited` is at the lower end of its range.
- Of the calibrated models, only `coulomb_limited` differs in x from the blocks by more than chance explains.
"""

TSCHAMUT_FAILS = """**Where the models fail.**
- No model fits the seven runs that were released in the east, near (59, 258), where the approximated terrain is
  gentler. Up to half of the rocks of a model stop there within 10 m of their release; no block stopped so near. For the
  other eleven runs, the mean error of all calibrated models except `constant` is below 8 m. These data do not show
  whether the terrain or the models are the reason.
- Compared with the rocks of the same release, the intervals of points and spheres contain 0 to 7 of 18 stops along the
  slope, and 1 or 2 across.
- No calibrated model distinguishes long runs from short runs. The correlation over runs is within 0.25 of zero; chance
  alone gives correlations up to 0.47.
- `constant` cannot fit the stops. Its friction angle is at the lower end of its range. Its mean runout is 26 to 29 m
  too short and hardly differs between runs. Along the slope, its intervals contain no kept-out stop.
- The stops hardly determine any restitution, and hardly the friction of rocks with a shape.
"""

DEFAULT = """## Why is `coulomb_limited` the default, and where is it weaker than `constant`?
`coulomb_limited` is the default because no impact removes more speed along the ground than friction can. With
`constant` [no speed is left when bouncing ends](physics.md#the-end-of-bouncing): unless the ground is slippery, the
runout is too short, which is unsafe. The field data alone do not decide between the two models.

`coulomb_limited` is **better** in these figures:

- the score of kept-out stops at Tschamut, where the intervals of `constant` contain no stop along the slope. At Authume
  the scores are equal within their standard error;
- the friction angles, which real ground can have on both slopes. The friction angles of `constant` are at the lower end
  of their range;
- the mean runout at Tschamut after calibration there.

`coulomb_limited` is **worse** in these figures:

- at Authume: the spreads along and across the slope, the Wasserstein distance in x, and the number of kept-out stops
  that its intervals contain;
- R_n at Authume, which is at the lower end of its range;
- predictions with values of the other slope. With values from Tschamut, nearly half of the rocks do not stop in the
  quarry at Authume.

At Chant Sura, `constant` is nearer to the six impacts with the published values of Hoek. `coulomb_limited` is nearer
with the published values of STONE, and with values that are calibrated on the eleven contacts.
"""

CHANT_SURA = """## Chant Sura
The data are single impacts on an alpine meadow, without trajectories. The models predict the speed after an impact from
the velocity before it. The *energy ratio* is the translational energy after the impact divided by the translational
energy before it.

- **Six impacts** (2.1 to 4.3 in the tables) of a block of 780 kg, with the speeds along and into the ground. These two
  speeds are computed from the height of the jump; no survey measured them.
- **Eleven contacts** of five other runs with blocks of 210, 250 and 780 kg. The velocities before and after each
  contact are known, but the slope of the ground is not. After six of the contacts the block moves downwards, so the
  ground there is not level. The tables assume slopes of 0, 15 and 30 degrees, falling in the direction of motion. In
  the calibration the slope is one more parameter.
- **The spin before an impact is unknown.** The tables assume 0 and, for the six impacts, also 27 rad/s forwards. This
  is the mean of four values of Lu et al. 2019 for such a block. A point has no spin.
- **`angle_table`** has `law: wyllie` in the tables.

**Where the models fail.**
- In one of the six impacts the translational energy is larger after the impact than before (ratio 1.11), because spin
  turned into speed. A model that never adds energy and starts without spin cannot show this.
- The measured energy ratios of the six impacts differ by a factor of five. The ratios of each model differ by a factor
  of at most {widest:.1f}. A flat block lands on a face, an edge or a corner; none of these models distinguishes the
  three cases.
- In the eleven contacts, slow blocks hit the ground at a steep angle; in the six impacts, fast blocks hit the ground at
  a shallow angle. With values of `constant` that are calibrated on the eleven contacts, the rocks keep far too little
  energy in the six impacts.
"""

NOT_VALIDATED = """## What does this page not show?
- Three sites (two of them meadows) with 59 blocks and 17 impacts are few. By chance, values from one site can look good
  or bad at another site.
- The page does not show whether a simulated difference between two designs is right.
- Only end points and single impacts are compared. Bounce heights, speeds and energies along the path, on which the
  design of barriers depends, are not compared.
- All points and spheres of a site have the same mass, and coefficients do not vary from impact to impact.
  Distributions in the scene (`normal_restitution: {mean: ...}`), `effects` and the real masses may give better results;
  no figure on this page shows whether they do.
- Calibrated values are valid only with rpf3d's own rules for the end of bouncing and for sliding, not in another
  program or model.
"""

SOURCES_OF_DATA = """## Where does the data come from?
The data is not part of this project. Put the folders into `shared/data`, next to the project's folder.

- **Authume**
  - Data: `authume/`: DTM_Blue_zone.stl, DTM_Gray_zone.stl, DTM_Red_zone.stl, positions_P1.xyz, Endpoints_P1.txt and, in
    `authume/blocks/`, SP1A.stl, SP2A.stl, SP2B.stl, SP3A.stl of richefeu/AuthumeQuarryRockfalls_Data-in-Brief (2025).
  - Literature: Garcia, Villard, Richefeu, Daudon, Comparison of full-scale rockfall tests with 3D complex-shaped DEM
    simulations, Eng. Geol.; Bourrier et al. 2021, Landslides 18:639-654.
- **Tschamut 2014**
  - Data: `tschamut2014/`: release_points.csv, observed_deposition.csv, block_metadata.csv, terrain.asc, from EnviDat
    doi:10.16904/envidat.34 (ODbL, DbCL), as tabulated in ofuhrer/rust_rockfall.
  - Literature: Volkwein & Gerber 2018, Geosciences 8(3):88.
- **Chant Sura**
  - Data: `chant_sura/`: observed_contact_events_extended.csv, esurf2019_impacts.csv, rock_shapes.csv, from EnviDat
    doi:10.16904/envidat.174, as tabulated in ofuhrer/rust_rockfall.
  - Literature: Caviezel et al. 2019, ESurf 7:199 (CC BY 4.0); Lu et al. 2019, Landslides 16:2353.
"""
