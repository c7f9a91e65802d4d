"""The prose of docs/explanation/validation.md. Figures of the field are published; those of models are of `page`."""

HEAD = """# Validation: against rocks that fell
This page compares simulated rocks with rocks that fell at three sites. Each model is flown with values from books
(**uncalibrated**) and with values fitted to the site's own data (**calibrated**). `make validation`
(`docs/validation.py`) calibrates, measures and writes this page. The field data is not part of this project (last
section).

- **Models**: `constant` and `coulomb_limited`, a point with `ground: sliding`; the rigid sphere, `coulomb_sphere`
  with `ground: sphere`. Every scene of this page names its rebound and its ground.
- **Uncalibrated**: published coefficients for ground of the same description, chosen without the end points. There
  are two libraries, to show how far two books differ.
- **Calibrated**: one set of parameters for the whole site. The search is a grid and two finer grids about the best
  place, with half the step each (`docs/field_cases/search.py`). Every set flies the same rocks (seed 1): 2,000 at
  Authume (500 of the sphere, which takes longer), 900 at Tschamut. The figures of this page are of other rocks (seed
  2): 10,000 and 9,000.
- **Kept out**: the same search on one half of a site's data, judged by the other half. This shows whether single
  blocks were fitted. Whether the values hold on another slope is the question of *From site to site*.
- **One basis**: field and simulation go through the same functions (`docs/field_cases/basis.py`). Both are measured
  from the field's start: the mean drop point at Authume, the release of the run at Tschamut. The place where a
  simulated rock was released enters no figure.
- Intervals are 95 %, of the *field's* few rocks: Wilson's for shares, bootstrap percentiles for all else. Intervals
  of 10,000 simulated rocks are a sixteenth as wide and left out.
"""

VERDICT = """Of the constant model:
- **Values from books are no prediction.** At Authume one book stops every rock on the upper slope, {hoek:+.0f} m off
  in the mean. The other is {stone:+.0f} m off, with more than twice the field's spread along the profile. At Tschamut
  they are {hoek_meadow:+.0f} and {stone_meadow:+.0f} m off; another code, untuned, is -35 m off.
- **Fitted, the model reaches what it is fitted to, and little else.** At Authume the mean is {off:+.1f} m off;
  {ledge:.0f} % stop on the ledge and {floor:.0f} % on the floor. The standard deviation of x is {sd:.1f} m instead of
  {field_sd:.1f} m. The lateral spread is {side:.1f} m, about two thirds of the field's {field_side:.1f} m and below
  the field's interval ({low_side:.1f} to {high_side:.1f} m). The farthest 5 % begin at {p95:.0f} m instead of
  {field_p95:.0f} m. A point with fixed coefficients has no shape that could send it elsewhere.
- **The fitted values are not a property of the ground.** One half of the 41 blocks gives an R_n, an R_t and a
  friction angle (degrees) of {first}, the other half {second}. No rock slope has such friction angles: sliding stands
  in for rolling.
- **At Tschamut the fit only looks good** ({meadow:+.0f} m, within the bar). The friction angle ends at the edge of
  the search ({meadow_friction:g} degrees). R_n decides nothing: {meadow_R_n:g} on all runs and {second_R_n:g} on one
  half do equally well. The model does not tell long
  runs from short ones (correlation {correlation:+.2f}): all rocks run onto the flat step at the foot of the proxy
  terrain.
- **The values do not carry over.** Authume's are {at_meadow:+.0f} m off at Tschamut, Tschamut's {at_quarry:+.0f} m at
  Authume. Values from single impacts are {impacts_quarry:+.0f} and {impacts_meadow:+.0f} m off. Calibrate on the
  slope in question, on rocks that fell there, or use the result only to compare variants.
"""

VERDICT_LIMITED = """Of the Coulomb-limited model:
- **Values from books bring rocks farther than in the constant model.** At Authume Hoek's values are {hoek:+.0f} m off
  in the mean, but leave half of the rocks on the upper slope and none on the ledge. STONE's values are {stone:+.0f} m
  off, and most rocks do not stop on the terrain. At Tschamut the two books are {hoek_meadow:+.0f} and
  {stone_meadow:+.0f} m off, beyond the 35 m of the other code.
- **Fitted at Authume, the model reaches what it is fitted to, and little else.** The mean is {off:+.1f} m off. The
  standard deviation of x is {sd:.1f} m, nearer to the field than the constant model's. The lateral spread of
  {side:.1f} m is smaller than the constant model's.
- **R_t ends at its lower bound at Authume** ({tangential_restitution:g}, {distance:.1f} m from the field's x; lateral
  spread {side:.1f} m). Where friction limits the loss, R_t decides little. A search with R_t of at least 0.35 ends at
  0.35, with a distance of 4.1 m and a lateral spread of 2.5 m: the wider grid mends the first and not the second.
- **The friction angle decides.** At Authume it is {friction_angle_deg:g} degrees on all blocks, {first_friction:g} and
  {second_friction:g} on the halves; at Tschamut {meadow_friction:g} degrees on all runs. Ground can have such angles.
  Four degrees more or less move the mean at Authume by more than eight metres.
- **At Tschamut it fits better than the constant model**: {meadow:+.0f} m in the mean, {absolute:.0f} m for a run, and
  it tells long runs from short ones a little (correlation {correlation:+.2f}). R_n ends at the edge of the search.
- **The values do not carry over either.** Authume's are {at_meadow:+.0f} m off at Tschamut in the mean, as the
  constant model's are, and farther off for a single run ({carried:.0f} m). Tschamut's are {at_quarry:+.0f} m off at
  Authume, much farther than the constant model's. Values from single impacts are {impacts_quarry:+.0f} and
  {impacts_meadow:+.0f} m off.
"""

VERDICT_SPHERE = """Of the rigid sphere, which is braked by rolling friction at impacts and on the ground:
- **Values from books are no prediction either.** At Authume they are {hoek:+.0f} and {stone:+.0f} m off in the mean,
  with no rock on the upper slope; at Tschamut {hoek_meadow:+.0f} and {stone_meadow:+.0f} m.
- **Fitted, it is about as good as the constant model at Authume**, and no better. The mean is {off:+.1f} m off, and
  the lateral spread of {side:.1f} m is smaller still. A sphere has no shape either.
- **At Tschamut it is worse than the constant model**: {meadow:+.0f} m in the mean, {absolute:.0f} m for a run
  (correlation {correlation:+.2f}). Some runs hardly leave their release, others reach the foot of the slope.
- **Its rolling friction is much the same at both sites** ({rolling_friction:g} at Authume, {meadow_rolling:g} at
  Tschamut), so the values carry over about as well as they fit: Authume's are {at_meadow:+.0f} m off at Tschamut
  ({carried:.0f} m for a run), Tschamut's {at_quarry:+.0f} m at Authume. Single impacts ask for {impacts_rolling:g}:
  {impacts_quarry:+.0f} and {impacts_meadow:+.0f} m off.
- **It is as sensitive as the other two.** At Authume four hundredths of rolling friction, up or down, move the mean by
  more than five metres.
"""

DEFAULT = """## Why is `coulomb_limited` the default, and where is it weaker than `constant`?
`coulomb_limited` is the default rebound because of its mechanics: no impact takes more speed along the ground than
friction can. `constant` takes a share at each of infinitely many impacts, so all speed is gone where bouncing ends, on
any slope, and the runout is too short: the unsafe side (`docs/explanation/physics.md`, *The end of bouncing*). **The
field does not decide between the two.** Fitted or not, neither is a prediction on a slope where it was not calibrated.

- **`coulomb_limited` is better**: fitted to all runs at Tschamut; along the profile at Authume (sd of x, the farthest
  5 %; the distance of x by little); with the books' values in three cases of four; on the six impacts at Chant Sura
  with values fitted to the eleven (with the books' values the two are about equal). Its fitted friction angles are
  from 20 to 30 degrees, on all data and on each half; those of `constant` are from 5 to 30.
- **`coulomb_limited` is worse**: lateral spread, fitted at Authume and at Tschamut; values carried between Authume and
  Tschamut. Where it is wrong with values from elsewhere, it can be wrong by much more.
- **No clear difference**: the halves that were kept out; speeds after the eleven contacts. Of six figures of kept-out
  halves `constant` is nearer in four, by about half a metre or less but for one lateral figure, and `coulomb_limited`
  is much nearer in one. Halves of 9 and 8 runs decide little, and they depend on the grid: with R_t searched from 0.35
  to 0.95 in both models the same rule gives 19.8 and 11.5 m on Tschamut's second half (`constant` first), and
  `coulomb_limited` is nearer in four of six.

Both are fitted with the same effort (next section). The rows of the table are not independent of each other, so their
number decides nothing.
"""

GRIDS = """## What is searched
`constant` and `coulomb_limited` have the same grids, the same rocks and the same ground; only the rebound differs. In
`coulomb_limited` the friction angle also limits what an impact takes. Single impacts (Chant Sura) calibrate R_n, R_t
or rolling friction, and the slope of the ground; the friction angle keeps its published value there, for all models.
Flights search R_t over its whole range, from 0 to 1. The sphere flies with a friction angle of 35 degrees (Newcastle
open-pit library), which is not searched.
"""

CURVES = """\
Another program for a lumped mass, with another rule for the end of bouncing, moved by 38 m in the first of these
steps, at R_n 0.25: that rule decides as much as a coefficient does.
"""

SENSITIVITY = """### What a few hundredths of a coefficient do
Mean x of end points (m) as one parameter takes five values about its calibrated value:
"""

AUTHUME_FAILS = """\
**Where it fails.** No calibrated model leaves a rock on the upper slope, where 2 of 41 blocks stopped, and no
calibrated point passes 59 m, as 5 of 41 blocks did. All three spread too little across the profile, so their hazard
maps are too narrow. For no model does one half of the blocks predict the other half as well as it fits itself.
"""

TSCHAMUT_FAILS = """\
**Where it fails.** All calibrated models overshoot the two shortest runs (31 and 46 m) by tens of metres. A mean error
of a few metres hides that. The runouts of the two point models have a standard deviation of 3 to 4 m over all
rocks, those of the field of 22 m over its runs. Those of the sphere have 36 m, but not where the field's are long.
"""

AUTHUME = """## Authume quarry, profile P1
An open pit in France: 41 blocks of 178 to 1,751 kg, dropped by a power shovel, over 9,001 triangles in three zones
(`config/scenes/authume_p1.yaml`). Lateral positions (z), runouts and reach angles are measured from the mean drop
point, in the field and in the simulation. Simulated rocks are dropped up to 1 m from each of the four drop points, so
the spread of the drop points is part of both lateral spreads. The field's end points lie 2.87 m above the mesh, a
shift of the datum: simulated end points are lifted by 2.87 m, which changes the reach angle alone. All rocks have the
blocks' mean mass. The search looks at x of the end points only. Lateral spread and reach angle are in no search, so
those columns test every row.
"""

TSCHAMUT = """## Tschamut 2014
18 runs of blocks of 40 to 79 kg on an alpine meadow. Run v034 repeats v033 to the last digit, so the calibration
takes 17 runs; means over all runs take 18. The terrain is a proxy in cells of 5 m, a plane with interpolated
residuals and not a survey, so only wide tolerances make sense: differences of some metres say nothing. The rocks of a
run start within 0.5 m of its release, with its velocity, one block's size above the ground and with the mean mass of
all blocks. Runouts, lateral positions and reach angles are measured from the field's release of the run; lateral is
across the direction from the mean release to the mean end point of the field. The bar to beat is another open code,
untuned, on the survey of 2 m: its mean runout error is -35.0 m for a translating mass and +104.6 m for a spinning
sphere.
"""

CHANT_SURA = """## Chant Sura
Single impacts on an alpine meadow, without trajectories: the speed after an impact from the velocity before. Six
impacts are of a block of 780 kg, with speeds along and into the ground; the split comes from the height of the jump,
not from a survey. Eleven contacts are of five other runs, of 210, 250 and 780 kg, with velocities before and after
but without the slope of the ground. Six of the eleven leave downwards, so the ground is not level. The slope is
therefore taken as 0, 15 and 30 degrees, dipping where the rock is heading, and is one more parameter of the
calibration. The spin before an impact is unknown: it is 0 and, for the six, also 27 rad/s forwards, the mean of four
values that Lu et al. 2019 give for such a block. A point has no spin. Energy is translational, before and after,
measured and predicted.
"""

CHANT_SURA_FAILS = """**Where it fails.**
- One of the six has more translational energy after the impact than before (1.11). It is real: spin turned into
  speed. A point cannot show it, and no sound model can that starts without spin.
- The six differ by a factor of five in their energy ratio, a model's answers by far less: a platy block lands on a
  face, an edge or a corner, and none of these models knows which.
- What the eleven contacts calibrate says little about the six. The eleven are steep and slow, the six flat and fast.
  Constant coefficients cannot be right for both.
"""

TRANSFER = """## From site to site
What is calibrated on all of one site's data, flown at all three sites; *its own site in italics*. Where single
impacts calibrate nothing (friction on the ground), the published value of the flown site is used.
"""

NOT_VALIDATED = """## What this page does not show
- There are three sites, two of them meadows, with 41 + 18 rocks and 17 impacts. Intervals are wide, and one site's
  fit can look good elsewhere by chance as well as bad.
- Only end points and single impacts are compared. Bounce heights, speeds along the way and energies, which barriers
  are designed by, are not.
- All rocks of a site have one mass, and their coefficients do not vary from impact to impact. Distributions in the
  scene (`normal_restitution: {mean: ...}`), `effects` and the field's own masses may do better; they are not measured
  here.
- Calibrated values belong to this program: to its rules for the end of bouncing and for sliding
  (`docs/explanation/physics.md`). In another program, or with another model, they mean something else.
"""

SOURCES_OF_DATA = """## Data
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
