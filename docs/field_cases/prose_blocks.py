"""The text of docs/explanation/validation.md on rocks with a shape; tables are inserted by `page_blocks`."""

BLOCKS = """## Rocks with a shape
Here a rock is a rigid convex body (`rock.shape` with `contact: rigid`), and the ground has three numbers for the whole
site: restitution, friction and rolling resistance. All sites use the same program and the same basis as above.
`python docs/validation.py --blocks` measures only this section, in about ten minutes of CPU time.

- **Fit**: at Authume only Wasserstein's distance of x, at Tschamut only the mean absolute error of runout. No lateral
  figure is in a fit.
- **Search**: a grid of 260 sets, with the same rocks (seed 1) for all sets. Each round keeps the best sets, which then
  fly more rocks (successive halving). The figures come from other rocks (seed 2).
- **Control**: the rigid sphere, which has no shape, calibrated on the same x.
"""

AT_QUARRY = """### Authume with the four scanned blocks
The rocks have the shapes and sizes of the four block files, each equally often, and random orientations
(`config/scenes/authume_p1_blocks.yaml`). 4,000 rocks.
"""

BARS = """Goals for the rocks with a shape. The field's interval gives the goal of the lateral sd. The standard error is
that of the number of simulated rocks. The range over the best sets shows what x alone does not determine:
"""

PER_SHAPE = """### Which shape goes how far?
All rows have the set that is calibrated on the four blocks:
"""

PER_BLOCK = """### Does a block's shape say where it stopped?
Each of the 41 blocks is simulated with its own mass, and with its own mass and three lengths. The hulls are those of
the four scanned blocks:
"""

AT_MEADOW = """### Tschamut with rocks of the blocks' masses and lengths
Each run's rocks have the mass and the three lengths of the run's block (an ideal equant body, stretched). The first row
has Authume's set without any change. 150 rocks a run.
"""

AT_IMPACTS = """### Chant Sura with norm blocks of 24 corners
Each impact is simulated with 1,000 random orientations, because the field's orientation is unknown. A contact ends when
the block has flown for 0.05 s. The block of the six impacts is flat (1 : 1 : 0.5).
"""

BLOCKS_FAIL = """**Where rocks with a shape fail.**
- The lateral sd at Authume is at the upper edge of the field's interval, not in its middle. Restitution and rolling
  resistance compensate each other in x, so x alone does not determine the spread: of the five sets that fit x best,
  three spread wider than the goal.
- The share beyond 55 m does not distinguish the models: the Coulomb-limited point and the sphere reach its goal too.
  The two spreads do.
- Sets from one half of Authume's blocks predict x of the other half worse than a point or a sphere does, by 0.4 to
  1.5 m. The halves themselves differ by 7.2 m. Each of the two sets misses the goal of mean x.
- Rocks with the proportions of all 41 blocks go farther and spread wider than the blocks. The four scanned blocks, on
  which the set is calibrated, are not a sample of the 41.
- Authume's set at Tschamut has an error of mean runout like those of the point models, and no correlation over runs.
  The heaviest block's rocks stop far too early. Calibrated at Tschamut, two of the three numbers are at the edge of the
  search, and both point models fit better.
- Tschamut's set at Authume sends the rocks more than ten metres too far.
- Authume's set at Chant Sura leaves five of the six fast, flat impacts too much energy, and the eleven slow, steep
  contacts too little speed. No rock gains translational energy as one block did (1.11).
- Three of the numbers that are calibrated on the eleven contacts are at the edge of the search, and points and sphere
  fit these contacts better.
"""
