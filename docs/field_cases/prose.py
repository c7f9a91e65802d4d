"""What docs/validation.md says beside its figures. Those of the field are published; those of models are `page`'s."""

HEAD = """# Validation: against rocks that fell
Three sites with real rocks, each flown with the values of books (**uncalibrated**) and with values fitted to its own
data (**calibrated**). `docs/validation.py` (`make validation`) calibrates, measures and writes this page; it needs
the field data, which is not part of this project (last section).

- **Uncalibrated**: coefficients that somebody published for ground of such a description, chosen without looking at
  where the rocks stopped. There are two libraries, to show how far two books differ.
- **Calibrated**: one set of parameters for the whole site, found by a grid and two finer grids about the best place
  (`docs/field_cases/search.py`), every set flown with the same rocks (seed 1; 2,000 at Authume, 500 of the dearer
  sphere, 900 at Tschamut). Figures below are of other rocks (seed 2; 10,000 and 9,000).
- **Kept out**: the same search on either half of a site's data, judged by the other half. It tells whether single
  blocks were fitted. It does not tell whether the values hold on another slope; that is *From site to site*.
- Intervals are 95 %, of the *field's* few rocks: Wilson's of shares, bootstrap percentiles of everything else. Those
  of 10,000 simulated rocks are a sixteenth of that and left out.
"""

NO_SPHERE = """The rigid sphere has no rows here: scenes of this version cannot name it. Where they can, it has.
"""

VERDICT = """Of the constant model, which every version has:
- **Values of books are no prediction.** At Authume one book stops every rock on the upper slope, {hoek:+.0f} m off in
  the mean, and the other is {stone:+.0f} m off with twice the field's spread and more. At Tschamut they are
  {hoek_meadow:+.0f} and {stone_meadow:+.0f} m off; another code, untuned, -35 m.
- **Fitted, it reaches what it is fitted to, and little else.** At Authume the mean is {off:+.1f} m off, {ledge:.0f} %
  stop on the ledge and {floor:.0f} % on the floor. But rocks spread by {side:.1f} m to the sides, where the field's
  did by {field_side:.1f} m, and the farthest 5 % begin at {p95:.0f} m, not at {field_p95:.0f} m: a point of mass with
  fixed coefficients has no shape that could send it elsewhere.
- **What is fitted is no property of the ground.** One half of the 41 blocks gives R_n, R_t and a friction angle of
  {first}, the other half {second}. No rock slope has such friction angles: sliding stands in for rolling.
- **At Tschamut the fit only looks good** ({fitted_meadow:+.0f} m, within the bar). The friction angle ends at the
  edge of what was searched ({edge:g} degrees), very different R_n and R_t do as well, and the runs are not told apart
  (correlation {correlation:+.2f}): all rocks run onto the flat step at the foot of the proxy terrain and stay there.
- **It does not carry over.** Authume's values are {at_meadow:+.0f} m off at Tschamut, Tschamut's {at_quarry:+.0f} m
  at Authume; what single impacts give is {impacts_quarry:+.0f} and {impacts_meadow:+.0f} m off. Calibrate on the
  slope in question, on rocks that fell there, or take the result as a comparison of variants and no more.
"""

VERDICT_SPHERE = """Of the rigid sphere:
- **With values of books it runs away**: at Authume all rocks end on the floor or beyond the terrain, {book:+.0f} m
  off in the mean. Books have no damping for it; calibrated it loses {lost:.0f} % of its speed along the ground and of
  its spin at every impact, beside friction.
- **Fitted, it is as good as the constant model at Authume**, and no better: mean {off:+.1f} m off, and its lateral
  spread of {side:.1f} m is too small as well. A sphere has no shape either.
- **At Tschamut it is better**: {meadow:+.0f} m in the mean, {absolute:.0f} m for a run, and it tells runs apart a
  little (correlation {correlation:+.2f}).
- **It does not carry over either**: Authume's values are {at_meadow:+.0f} m off at Tschamut, Tschamut's
  {at_quarry:+.0f} m at Authume.
"""

CURVES = """(A lumped mass with another rule for the end of bouncing moved by 38 m in the first of these, at R_n 0.25:
that rule decides as much as a coefficient does.)
"""

AUTHUME_FAILS = """**Where it fails.** Everybody on the upper slope is missed (2 of 41 blocks stayed there), and so is
everybody beyond 55 m (5 of 41), where the fitted constant model has nobody. Lateral spread is less than half of the
field's, so hazard maps of such a model are too narrow. Neither half of the blocks foretells the other one as well as
it fits itself.
"""

TSCHAMUT_FAILS = """**Where it fails.** The two shortest runs (31 and 46 m) are overshot by tens of metres, the
longest stop short: a mean error of a few metres hides both. On this terrain the data cannot tell one set of
parameters from another.
"""

AUTHUME = """## Authume quarry, profile P1
An open pit in France: 41 blocks of 178 to 1,751 kg, dropped by a power shovel, over 9,001 triangles in three zones
(`config/scenes/authume_p1.yaml`). The field's end points lie 2.87 m above the mesh, a shift of the datum, so x and z
are compared; for the reach angle alone simulated ends are lifted by as much. All rocks have the blocks' mean mass.
The search looks at x of the ends only; lateral spread and reach angle are in no search, so those columns test every
line.
"""

TSCHAMUT = """## Tschamut 2014
18 runs of blocks of 40 to 79 kg on an alpine meadow; v034 repeats v033 to the last digit, so calibration takes 17.
The terrain is a proxy in cells of 5 m, a plane with interpolated residuals and no survey, so only wide tolerances
make sense: differences of some metres say nothing. Each run's rocks start about its release with its velocity, one
block's size above the ground, with the mean mass of all. The bar to beat is another open code, untuned, on the survey
of 2 m: its mean runout error is -35.0 m for a translating mass and +104.6 m for a spinning sphere.
"""

CHANT_SURA = """## Chant Sura
Single impacts on an alpine meadow, no trajectories: the speed after an impact from that before. Six of a 780 kg
block, with speeds along and into the ground (the split comes from the height of the jump, not from a survey), and
eleven contacts of five other runs of 210, 250 and 780 kg with velocities before and after, but without the slope of
the ground, and six of them leave downwards, so it is no level floor. The slope is therefore taken as 0, 15 and 30
degrees, dipping where the rock is heading, and is one more parameter of the calibration. Spin before the impact is
not told: it is 0 and, for the six, 27 rad/s forwards as well, the mean of four that Lu et al. 2019 give for such a
block. A lumped mass does not know the difference. Energy is translational.
"""

CHANT_SURA_FAILS = """**Where it fails.**
- One of the six has more translational energy after the impact than before (1.11). It is real: spin turned into
  speed. A lumped mass cannot show it, and no sound model can that starts without spin.
- The six differ by a factor of five in their energy ratio, a model's answers by far less: a platy block lands on a
  face, an edge or a corner, and none of these models knows which.
- What the eleven contacts calibrate says little of the six. The eleven are steep and slow, the six flat and fast, and
  constant coefficients cannot be right for both.
"""

TRANSFER = """## From site to site
What is calibrated on all of one site's data, flown on all three; *its own site in italics*. What single impacts
cannot calibrate (friction on the ground) is the published value of the site that is flown.
"""

NOT_VALIDATED = """## What this is not
- Three sites, two of them meadows, 41 + 18 rocks and 17 impacts: intervals are wide, and one site's fit can look good
  elsewhere by chance as well as bad.
- End points and single impacts only. Bounce heights, speeds along the way and energies, which barriers are designed
  by, are compared with nothing here.
- All rocks of a site have one mass, and coefficients that do not vary from impact to impact. Distributions in the
  scene (`normal_restitution: {mean: ...}`), `effects` and the field's own masses may do better; that is not measured
  here.
- Calibrated values are of this program: of its rules for the end of bouncing and for sliding (`docs/design.md`). In
  another program, or with another model, they mean something else.
"""

SOURCES_OF_DATA = """## Data
Not part of this project; put the folders into `shared/data`, beside the project's own folder.

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
