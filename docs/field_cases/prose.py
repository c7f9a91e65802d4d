"""What docs/validation.md says beside its figures."""

HEAD = """# Validation: against rocks that fell
Three sites with real rocks, each flown with the values of books (**uncalibrated**) and with values fitted to a half of
its own data (**calibrated**), the other half kept out. `docs/validation.py` (`make validation`) calibrates, measures
and writes this page; it needs the field data, which is not part of this project (last section).

What counts as what:
- **Uncalibrated**: coefficients that somebody published for ground of such a description, chosen before looking at
  where the rocks stopped. There are two libraries, to show how far two books differ.
- **Calibrated**: one set of parameters for the whole site, found by a grid and two finer grids about the best place
  (`docs/field_cases/search.py`), each set flown with the same rocks (seed 1). Figures below are of other rocks (seed
  2; 10,000 at Authume, 9,000 at Tschamut).
- **Kept out**: data of the *same* site that the search has not seen. It tells overfitting to blocks. It does not tell
  whether the values hold on another slope: that is the table *From site to site*, and it is the one to remember.
- Intervals are 95 %: Wilson's of shares, bootstrap percentiles of everything else, of the *field's* few rocks. Those
  of 10,000 simulated rocks are a tenth of that and left out.
"""

NO_SPHERE = """The rigid sphere has no rows here: no scene of this version can name it. The report adds them by itself where it can.
"""

AUTHUME = """## Authume quarry, profile P1
An open pit in France: 41 blocks of 178 to 1,751 kg, dropped by a power shovel, over 9,001 triangles in three zones
(`config/scenes/authume_p1.yaml`). The field's end points lie 2.87 m above the mesh, a shift of the datum, so x and z
are compared; for the reach angle alone simulated ends are lifted by as much. All rocks have the blocks' mean mass.
The calibration sees x of every second block, from the first line of the file on; lateral spread and reach angle are
in no search, so their columns are a test of all lines.
"""

TSCHAMUT = """## Tschamut 2014
18 runs of blocks of 40 to 79 kg on an alpine meadow (v034 repeats v033 to the last digit, so both stand in the
same half, once). The terrain is a proxy of 5 m cells made from release and end points, so that errors below a few cells
mean nothing. Each run's rocks start about its release with its velocity, one block's size above the ground, with the
mean mass of all. The calibration sees runouts of every second distinct run. The bar to beat is another open code,
untuned, on the survey of 2 m: its mean runout error is -35.0 m for a translating mass and +104.6 m for a spinning sphere.
"""

CHANT_SURA = """## Chant Sura
Single impacts on an alpine meadow, no trajectories: what a rebound model says of the speed after an impact, given that
before. Six of a 780 kg block with speeds along and into the ground (the split comes from the height of the jump, not from
a survey), and eleven contacts of five other runs of 210, 250 and 780 kg with velocities before and after, but without the slope
of the ground. That slope is therefore taken as 0, 15 and 30 degrees, dipping where the rock is heading, and is a third
parameter where the eleven are calibrated on. Spin before the impact is not told: it is 0, and for the six 27 rad/s
forwards as well, the mean of four that Lu et al. 2019 give for such a block. A lumped mass does not know the difference.

Energy is translational. **One of the six has more of it after the impact than before (1.11): it is real, spin turned
into speed, and nothing that starts without spin can show it.** A platy block also lands on an edge or on a face, which
no model here knows: one pair of coefficients is one ratio for one angle, the field has 0.22 and 0.42 to 1.11 for
angles of 6 to 25 degrees.
"""

TRANSFER = """## From site to site
What is calibrated on one site, flown on all three; *its own site in italics*. What single impacts cannot calibrate
(friction on the ground) is then the site's published value.
"""

NOT_VALIDATED = ""

SOURCES_OF_DATA = """## Data
Not part of this project; put the folders into `shared/data`, beside the project's own folder.

| site | data | literature |
|---|---|---|
| Authume | `authume/`: DTM_Blue_zone.stl, DTM_Gray_zone.stl, DTM_Red_zone.stl, positions_P1.xyz, Endpoints_P1.txt of \
richefeu/AuthumeQuarryRockfalls_Data-in-Brief | Garcia, Villard, Richefeu, Daudon, Eng. Geol.; Bourrier et al. 2021, \
Landslides 18:639-654 |
| Tschamut 2014 | `tschamut2014/`: release_points.csv, observed_deposition.csv, terrain.asc, made from EnviDat \
doi:10.16904/envidat.34 (ODbL), as tabulated in ofuhrer/rust_rockfall | Volkwein & Gerber 2018, Geosciences 8(3):88 |
| Chant Sura | `chant_sura/`: observed_contact_events_extended.csv, esurf2019_impacts.csv, made from EnviDat \
doi:10.16904/envidat.174, as tabulated in ofuhrer/rust_rockfall | Caviezel et al. 2019, ESurf 7:199 (CC BY 4.0); Lu et \
al. 2019, Landslides 16:2353 |
"""
