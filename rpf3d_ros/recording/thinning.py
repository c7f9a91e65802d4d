"""The setting for how much of the answers is recorded, and the text in a recording that states what is left out."""

from typing import NamedTuple

from rpf3d_ros.interface.recorded_topics import RecordedSensors


class Thinning(NamedTuple):
    """Part of the answers that is recorded; inputs, alerts and the figures of answers are always recorded.

    rocks : number of recorded rocks of an answer, of those published; those that reach an area always are; 0: all
    maps_every : shortest time (s) between recorded hazard maps, unless an alert level changes; 0: no limit

    Unless both are 0, rocks and maps that do not differ from those recorded last are not recorded again.
    """

    rocks: int = 50
    maps_every: float = 10.0

    @property
    def is_whole(self) -> bool:
        """True if nothing is left out."""
        return self.rocks == 0 and self.maps_every == 0.0

    @property
    def text(self) -> str:
        """The text "About this recording", as Markdown: what the recording leaves out, if anything."""
        if self.is_whole:
            return "# About this recording\nEvery answer is recorded as published.\n"
        return f"# About this recording\n{self._rocks_text}{self._maps_text}{ALWAYS}"

    @property
    def _rocks_text(self) -> str:
        if not self.rocks:
            return "- **Rocks**: an answer that does not differ from the answer before is not recorded again.\n"
        return (
            f"- **Rocks are left out.** Of each answer, {self.rocks} rocks are recorded: first every rock whose path "
            f"reaches an area of interest, also if there are more than {self.rocks}; then others, evenly. A path has "
            f"at most {POINTS_A_ROCK} points. Rocks that do not differ from those of the answer before are not "
            "recorded again. The plot of energies counts all published rocks.\n"
        )

    @property
    def _maps_text(self) -> str:
        if not self.maps_every:
            return "- **Hazard maps** are recorded when they change.\n"
        return (
            f"- **Hazard maps are left out.** They are recorded at most every {self.maps_every:g} s, the newest of "
            "that time, when they differ; and at each change of an alert level, those before and after the change.\n"
        )


POINTS_A_ROCK = 50
"""Largest number of recorded points of a rock's path in a thinned recording."""

WHOLE = Thinning(rocks=0, maps_every=0.0)
"""The setting with which a recording leaves nothing out."""

ALWAYS = (
    "- Every message with sources or areas and the figures of every answer are recorded; terrain, alerts and the alarm "
    "whenever they change.\n"
    "- The evidence of each alert is in the simulator's decision log, which is never thinned (`rpf3d audit`). A bag of "
    "the recorder has every message.\n"
)


def text_of(sensors: RecordedSensors) -> str:
    """Return the line that names the recorded topics of sources, as Markdown, to append to `Thinning.text`."""
    topics = (*sensors.poses, *sensors.clouds, "clicked_point")
    return f"- Sources are recorded of these topics: {', '.join(f'`{topic}`' for topic in topics)}.\n"
