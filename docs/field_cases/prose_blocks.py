"""Texts of docs/explanation/validation.md on rocks with a shape; `page_blocks` inserts the tables."""

BLOCKS = """## Rocks with a shape
Here a rock is a rigid convex body (`rock.shape` with `contact: rigid`). The ground has three coefficients for the whole
site: restitution, friction and rolling resistance. The tables above have calibrations, scores and predictions of these
rocks. This section shows the effect of the shape; `python docs/validation.py --blocks` measures it.
"""

BARS = """### Does a fit to x also give the lateral spread?
Not reliably: with four of the five sets of values that fit x best, rocks spread wider across the slope than the goal.

The scene `config/scenes/authume_p1_blocks.yaml`, which comes with rpf3d, has one value for each of the three
coefficients. A search tried 260 sets of values, and chose the set whose distribution of x is nearest to the
distribution of the 41 blocks. The search did not use lateral figures, so the lateral figures in the table test the
model.

The values are within the 90 % intervals of the calibration. The figures in the table come from 4,000 rocks that the
search did not use. Only the range over the 5 best sets comes from the rocks of the search, with which the lateral sd of
the chosen set is slightly above the goal. A *goal* is the range in which the developers want a figure to lie; the goal
of the lateral sd is the 95 % interval of the field. The next line has the values, and in brackets the Wasserstein
distance in x (m) and the number of sets tried.
"""

PER_SHAPE = """### Which shape goes how far?
All rows have the coefficients of the scene above. The masses of the four scanned blocks are their volumes times 2,700
kg/m3, so SP2B is heavier than the heaviest of the 41 blocks.
"""

PER_BLOCK = """### Does a block's shape decide where it stopped?
Partly: with the proportions of each block, simulated and observed x correlate; with the mass alone they do not. In the
first row, each of the 41 blocks is simulated with its own mass, in the second row with its own mass and its three
lengths. The shapes are the hulls of the four scanned blocks. L1, L2 and L3 are the three lengths of a block, the
longest first:
"""

AT_IMPACTS = """### Chant Sura with norm blocks of 24 corners
Norm blocks are the ideal blocks of concrete that rockfall tests use. Each impact is simulated with 1,000 random
orientations of the block, because the orientation in the field is unknown. A contact ends when the block has flown for
0.05 s. The block of the six impacts is flat (1 : 1 : 0.5). *Inside* counts the impacts whose measured energy ratio lies
between the 5th and the 95th percentile of the simulated orientations. *Largest of all* is the largest energy ratio of
any orientation in any of the six impacts. The next line has the coefficients that fit the eleven contacts best, and in
brackets the error of the speeds after the contacts (m/s) and the number of sets tried.
"""

IN_COLUMNS = """The table has the energy ratio of each of the six impacts: the mean, and in brackets 5 to 95 % of the
orientations. The columns *Authume* have the coefficients of Authume, the columns *calibrated* those that are
calibrated on the eleven contacts.
"""

BLOCKS_FAIL = """**Where rocks with a shape fail.**
- The lateral sd with the values of the scene is at the upper end of the field's interval. Restitution and rolling
  resistance compensate each other in x, so x alone does not determine the spread. With four of the five sets that fit x
  best, rocks spread wider than the goal.
- Rocks with the proportions of all 41 blocks go farther and spread wider than the blocks. The values of the scene
  were found with the four scanned blocks, and these are not a random sample of the 41 blocks.
- With the coefficients of Authume, rocks at Chant Sura keep too much energy in five of the six fast, shallow impacts,
  and too little speed after the eleven slow, steep contacts. No rock gains translational energy, but one block did
  (ratio 1.11).
- Three of the coefficients that are calibrated on the eleven contacts are at the edge of the search. Points and spheres
  fit these contacts better.
"""
