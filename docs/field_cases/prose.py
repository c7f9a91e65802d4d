"""The prose of docs/explanation/validation.md. Figures of the field are published; those of models are of `page`."""

HEAD = """# Validation: simulated rocks against rocks that fell
This page is for mine engineers who ask how far to trust a runout, and for maintainers. It compares simulated rocks
with rocks that fell at three sites.
"""

VERDICT = """**No, not on a slope where the model was not calibrated.** Calibrate on rocks that fell on the slope in
question, or use the result only to compare variants.

- **Values from books are no prediction.** In the mean they are {book_low:+.0f} to {book_high:+.0f} m off at Authume
  and {meadow_low:+.0f} to {meadow_high:+.0f} m off at Tschamut. Another open code, untuned, is {bar:+.0f} m off at
  Tschamut. The Coulomb-limited model with Hoek's values is {lucky:+.0f} m off at Authume, but leaves half of the
  rocks on the upper slope and none on the ledge. Books' values bring rocks farther in it than in the constant model.
- **Fitted at Authume, each model reaches what it is fitted to, and little else.** The mean is within {off:.1f} m of the
  field's. The standard deviation is {sd_low:.1f} to {sd_high:.1f} m along the profile (field: {field_sd:.1f} m) and
  {side_low:.1f} to {side_high:.1f} m across it (field: {field_side:.1f} m). A point or a sphere has no shape that
  could send rocks elsewhere.
- **Fitted values are not a property of the ground.** The constant model's friction angles at Authume fit no rock
  slope: sliding stands in for rolling.
- **At Tschamut the fits look better than they are**: see *Where it fails* in [that section](#tschamut-2014).
- **Values do not carry over to another slope.** Values from Authume are {at_meadow} m off at Tschamut (constant,
  Coulomb-limited, rigid sphere). Values from Tschamut are {at_quarry} m off at Authume. Values from single impacts
  are {impacts_quarry} m off at Authume and {impacts_meadow} m off at Tschamut.
- **Small changes matter.** At Authume the mean moves by more than five metres with 0.04 more or less of R_n
  (constant) or of rolling friction (sphere), and by more than eight metres with four degrees more or less of friction
  angle (Coulomb-limited).
"""

METHOD = """## How are field and simulation compared?
`make validation` (`docs/validation.py`) calibrates, measures and writes this page. `python docs/validation.py --as-is`
writes the page from the last measurement.

- **Models**: `constant` and `coulomb_limited`, a point with `ground: sliding`; the rigid sphere, `coulomb_sphere` with
  `ground: sphere`. Every scene of this page names its rebound and its ground.
- **Uncalibrated**: published values for ground of the same description, chosen without the end points. Two libraries
  show how far two books differ.
- **Calibrated**: one set of parameters for the whole site, from a grid and two finer grids about the best place, each
  with half the step. All sets have the same rocks (seed 1): 2,000 at Authume (500 spheres, which take longer), 900 at
  Tschamut. The figures of this page are of other rocks (seed 2): 10,000 and 9,000.
- **Kept out**: the same search on one half of a site's data, judged by the other half. It shows whether single blocks
  were fitted.
- **One basis**: field and simulation go through the same functions and start at the field's start (the mean drop
  point at Authume, the run's release at Tschamut). A simulated rock's own release enters no figure.
- **Intervals** are 95 %, of the *field's* few rocks: Wilson's for shares, bootstrap percentiles for all else.
  Intervals of 10,000 simulated rocks are a sixteenth as wide and left out.
- **Angles** are in degrees; the correlation over runs is between simulated and seen runouts.
"""

DEFAULT = """## Why is `coulomb_limited` the default, and where is it weaker than `constant`?
`coulomb_limited` is the default because of its mechanics: no impact takes more speed along the ground than friction
can. `constant` takes a share at each of infinitely many impacts. All speed is gone where bouncing ends, on any slope,
so the runout is too short: the unsafe side ([physics](physics.md), *The end of bouncing*). **The field does not decide
between the two.** Fitted or not, neither is a prediction on a slope where it was not calibrated.

- **`coulomb_limited` is nearer to the field**: fitted to all runs at Tschamut (but for the spreads); along the profile
  at Authume (sd, p95; the distance of x by little); with the books' values in three cases of four; on the six impacts
  at Chant Sura with values fitted to the eleven (with the books' values the two are about equal). Its fitted friction
  angles are 20 to 30 degrees on all data and on each half, as ground can have; those of `constant` are 5 to 30.
- **`coulomb_limited` is farther off**: lateral spread, fitted at Authume and at Tschamut; values carried between
  Authume and Tschamut. There it can be wrong by much more.
- **No clear difference**: speeds after the eleven contacts; kept-out halves. Of six figures of kept-out halves
  `constant` is nearer in four, by about half a metre or less but for one lateral figure, and `coulomb_limited` is much
  nearer in one. Halves of 9 and 8 runs decide little, and they depend on the grid: with R_t searched from 0.35 to 0.95
  the errors on Tschamut's second half are 19.8 m (`constant`) and 11.5 m, and `coulomb_limited` is nearer in four of
  six.
"""

GRIDS = """## What is searched?
`constant` and `coulomb_limited` have the same grids, rocks and ground; only the rebound differs. In `coulomb_limited`
the friction angle also limits what an impact takes. Single impacts (Chant Sura) calibrate two coefficients and the
slope of the ground; the friction angle keeps its published value there. The sphere has a friction angle of 35 degrees
(Newcastle open-pit library), which is not searched.
"""

CURVES = """\
Another program for a lumped mass, with another rule for the end of bouncing, moved by 38 m in that step: the rule
decides as much as a coefficient does.
"""

SENSITIVITY = """### What do a few hundredths of a coefficient change?
Mean x of end points (m) as one parameter takes five values (in brackets) about its calibrated value:
"""

AUTHUME_FAILS = """\
**Where it fails.**
- No calibrated model leaves a rock on the upper slope, where 2 of 41 blocks stopped. No calibrated point passes 59 m,
  as 5 of 41 blocks did.
- All three spread too little across the profile, so their hazard maps are too narrow.
- For no model does one half of the blocks predict the other half as well as it fits itself.
- The Coulomb-limited R_t ends at its lower bound: where friction limits the loss, R_t decides little. A search with
  R_t of at least 0.35 ends at 0.35, with a distance of 4.1 m in x and a lateral spread of 2.5 m.
"""

TSCHAMUT_FAILS = """\
**Where it fails.**
- All calibrated models overshoot the two shortest runs (31 and 46 m) by tens of metres. A mean error of a few metres
  hides that.
- `constant`: the friction angle ends at the edge of the search, and R_n decides nothing: very different values fit all
  runs equally well. It does not distinguish long runs from short ones: all rocks run onto the flat step at the foot
  of the proxy.
- `coulomb_limited` fits best and distinguishes long runs from short ones a little. R_n ends at the edge of the search.
- The rigid sphere is worse than `constant`: some runs hardly leave their release, others reach the foot of the slope.
- The runouts of the two points spread too little. Those of the sphere spread more than the field's, but not where the
  field's are long.
"""

AUTHUME = """## Authume quarry, profile P1
41 blocks of 178 to 1,751 kg, dropped by a power shovel in an open pit in France, over 9,001 triangles in three zones
(`config/scenes/authume_p1.yaml`).

- Simulated rocks are dropped up to 1 m from each of the four drop points and have the blocks' mean mass. The spread of
  the drop points is part of both lateral spreads. Lateral is z.
- The field's end points lie 2.87 m above the mesh, a shift of the datum. Simulated end points are lifted by 2.87 m,
  which changes the reach angle alone.
- The search looks at x of the end points only. Lateral spread and reach angle are in no search, so those columns test
  every row.

Calibrated values (distance from the field's x in m; sets tried):
"""

CHECKS = "Checks: mean x 44.1 ± 5 m; ledge 51 ± 15 points; floor 44 ± 15 points.\n"

TSCHAMUT = """## Tschamut 2014
18 runs of blocks of 40 to 79 kg on an alpine meadow. Run v034 repeats v033 to the last digit, so the calibration takes
17 runs; means take 18.

- The terrain is a proxy in cells of 5 m, a plane with interpolated residuals and not a survey. Differences of some
  metres say nothing.
- The rocks of a run start within 0.5 m of its release, with its velocity, one block's size above the ground and with
  the mean mass of all blocks.
- Lateral is across the direction from the mean release to the mean end point of the field.
- The bar to beat is the translating mass of another open code, untuned, on the survey of 2 m.

Calibrated values (mean absolute error of runout in m; sets tried):
"""

CHANT_SURA = """## Chant Sura
Single impacts on an alpine meadow, without trajectories: the speed after an impact from the velocity before. Energy is
translational.

- **Six impacts** of a block of 780 kg, with speeds along and into the ground. The split comes from the height of the
  jump, not from a survey.
- **Eleven contacts** of five other runs, of 210, 250 and 780 kg, with velocities before and after, but without the
  slope. Six of them leave downwards, so the ground is not level. The slope is taken as 0, 15 and 30 degrees, dipping
  where the rock is heading, and is one more parameter of the calibration.
- **The spin before an impact is unknown**: 0 and, for the six, also 27 rad/s forwards, the mean of four values of Lu et
  al. 2019 for such a block. A point has no spin.

**Where it fails.**
- One of the six has more translational energy after the impact than before (1.11): spin turned into speed. No sound
  model that starts without spin can show it, and a point never can.
- The energy ratios of the six differ by a factor of five, a model's answers by far less: a platy block lands on a face,
  an edge or a corner, and none of these models knows which.
- The eleven are steep and slow, the six flat and fast. What the eleven calibrate says little about the six. Constant
  coefficients cannot be right for both.
"""

TRANSFER = """## From site to site
Values calibrated on all of one site's data, used at all three sites; *its own site in italics*. Where single impacts
calibrate nothing (friction on the ground), the published value of the simulated site is used. The sphere's rolling
friction is much the same at Authume and Tschamut, so its values carry over about as well as they fit.
"""

NOT_VALIDATED = """## What does this page not show?
- There are three sites, two of them meadows, with 41 + 18 rocks and 17 impacts. Intervals are wide. One site's fit can
  look good elsewhere by chance as well as bad.
- Only end points and single impacts are compared. Bounce heights, speeds along the way and energies, which barriers are
  designed by, are not.
- All rocks of a site have one mass, and coefficients do not vary from impact to impact. Distributions in the scene
  (`normal_restitution: {mean: ...}`), `effects` and the field's own masses may do better; they are not measured.
- Calibrated values belong to this program's rules for the end of bouncing and for sliding ([physics](physics.md)). In
  another program or model they mean something else.
"""

SOURCES_OF_DATA = """## Where does the data come from?
The data is not part of this project. Put the folders into `shared/data`, next to the project's own folder.

| site | data | literature |
| --- | --- | --- |
| Authume | `authume/`: DTM_Blue_zone.stl, DTM_Gray_zone.stl, DTM_Red_zone.stl, positions_P1.xyz, Endpoints_P1.txt \
of richefeu/AuthumeQuarryRockfalls_Data-in-Brief (2025) | Garcia, Villard, Richefeu, Daudon, Comparison of \
full-scale rockfall tests with 3D complex-shaped DEM simulations, Eng. Geol.; Bourrier et al. 2021, Landslides \
18:639-654 |
| Tschamut 2014 | `tschamut2014/`: release_points.csv, observed_deposition.csv, terrain.asc, from EnviDat \
doi:10.16904/envidat.34 (ODbL, DbCL), as tabulated in ofuhrer/rust_rockfall | Volkwein & Gerber 2018, Geosciences \
8(3):88 |
| Chant Sura | `chant_sura/`: observed_contact_events_extended.csv, esurf2019_impacts.csv, from EnviDat \
doi:10.16904/envidat.174, as tabulated in ofuhrer/rust_rockfall | Caviezel et al. 2019, ESurf 7:199 (CC BY 4.0); Lu \
et al. 2019, Landslides 16:2353 |
"""
