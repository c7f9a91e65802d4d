"""The text of docs/explanation/validation.md on rocks with a shape; tables are inserted by `page_blocks`."""

BLOCKS = """## Rocks with a shape
Here a rock is a rigid convex body (`rock.shape` with `contact: rigid`), and the ground has three numbers for the whole
site: restitution, friction and rolling resistance. Calibrations, scores and predictions are in the tables above; this
section shows what the shape does. `python docs/validation.py --blocks` measures only this section.
"""

BARS = """### What does x alone determine?
The shipped scene `config/scenes/authume_p1_blocks.yaml` has one set of numbers. Of a grid of 260 sets it is the nearest
to the blocks in x; no lateral figure is in this search. All sets fly the same rocks, and each round keeps the best
sets, which then fly more rocks (successive halving). So the lateral figures are a check of the model. The set lies
within the 90 % intervals of the calibration. The figures are of 4,000 other rocks. In brackets after the set: the
distance in x (m) and the number of sets tried.
"""

PER_SHAPE = """### Which shape goes how far?
All rows have the set of the shipped scene:
"""

PER_BLOCK = """### Does a block's shape say where it stopped?
Each of the 41 blocks is simulated with its own mass, and with its own mass and three lengths. The hulls are those of
the four scanned blocks:
"""

AT_IMPACTS = """### Chant Sura with norm blocks of 24 corners
Each impact is simulated with 1,000 random orientations, because the field's orientation is unknown. A contact ends when
the block has flown for 0.05 s. The block of the six impacts is flat (1 : 1 : 0.5).
"""

BLOCKS_FAIL = """**Where rocks with a shape fail.**
- The lateral sd of the shipped set is at the upper edge of the field's interval, not in its middle. Restitution and
  rolling resistance compensate each other in x, so x alone does not determine the spread: of the five sets that fit x
  best, four spread wider than the goal.
- The calibrated sphere has nearly enough spread in x and beyond 55 m; across the slope it has half of the field's.
- Rocks with the proportions of all 41 blocks go farther and spread wider than the blocks. The four scanned blocks, on
  which the set is calibrated, are not a sample of the 41.
- Authume's set at Chant Sura leaves five of the six fast, flat impacts too much energy, and the eleven slow, steep
  contacts too little speed. No rock gains translational energy as one block did (1.11).
- Three of the numbers that are calibrated on the eleven contacts are at the edge of the search, and points and sphere
  fit these contacts better.
"""
