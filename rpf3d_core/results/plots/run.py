"""Draw all pictures of a run: the hazard maps, the profiles, the map of the rocks, and the convergence."""

from pathlib import Path

from rpf3d_core.results.plots.convergence import write_convergence
from rpf3d_core.results.plots.hazard import write_hazard_pictures
from rpf3d_core.results.plots.map import write_map
from rpf3d_core.results.plots.profiles import write_profile_plots
from rpf3d_core.results.plots.shading import GroundPictures
from rpf3d_core.results.plots.sheet import OVERVIEW_PIXELS, warm_up, whole_window
from rpf3d_core.results.shown import MapContent, RunPictures
from rpf3d_core.terrain.facets import Terrain


class Painter:
    """Draws the pictures of one run: first `begin` with the terrain, then `draw` when the rocks have flown.

    A second process makes this object while the main process reads the scene; see `painting.Painting`.
    """

    def warm_up(self) -> None:
        """Draw a map and discard it, because the first picture of a process takes 0.1 s longer than later pictures."""
        warm_up()

    def begin(self, terrain: Terrain) -> None:
        """Set the terrain of the run, and prepare its small overview, which most maps include."""
        self._terrain, self._ground = terrain, GroundPictures(terrain)
        self._ground.shaded(whole_window(terrain), OVERVIEW_PIXELS)

    def draw(self, folder: Path, shown: RunPictures) -> None:
        """Write all pictures into a result folder, with the points of the profiles in `profiles/`.

        The folder `hazard/` exists already.
        """
        content = MapContent(name=shown.name, terrain=self._terrain, areas=shown.areas, flown=shown.flown)
        flights, samples, flown = shown.flights, shown.samples, shown.flown
        releases = flights.deposits.release
        write_hazard_pictures(folder / "hazard", content, shown.maps, releases, shown.obstacles, self._ground)
        if len(samples.starts):
            profiles = folder / "profiles"
            profiles.mkdir()
            write_profile_plots(profiles, shown.sources, self._terrain, flights, samples, shown.gravity, flown)
        write_map(folder / "map.png", content, flights.deposits, samples, shown.obstacles, self._ground)
        if shown.target is not None:
            name = f"{shown.name}, {flown.describe()}"
            write_convergence(folder / "convergence.png", name, shown.steps, shown.target)
