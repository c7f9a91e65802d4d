"""What is known from before the start: the state that the decision log saved, and the terrain that was stored."""

from collections.abc import Collection, Mapping
from typing import Any

from rpf3d_core.live.ground import LiveTerrain
from rpf3d_ros.alerts.source_topics import BY_HAND
from rpf3d_ros.alerts.topics_before import has_moved, unjudged_topics
from rpf3d_ros.engine.configuration import StationConfiguration
from rpf3d_ros.engine.survey_in_use import SurveyInUse, survey_in_use
from rpf3d_ros.engine.terrain_faults import TerrainLack, lack_of, not_restored, terrain_to_remember


class BeforeStart:
    """The state before the start: what the decision log saved, and the terrain that was restored from the store.

    Without a decision log, nothing was saved. `heard`, `missed`, `areas` and `refused` contain only topics that the
    node still has. `unjudged` has the topics whose danger cannot be judged any more.

    memory : (attribute) the saved state as plain values, made by `Station._inputs_to_remember` and the alert desk
    terrain : (attribute) the terrain that was restored from the store, None if no terrain was restored
    """

    def __init__(self, configuration: StationConfiguration) -> None:
        """Read the saved state; configuration : configuration of the station, with the opened log and store."""
        log, standing = configuration.log, configuration.standing
        self._configuration = configuration
        self.memory: Mapping[str, Any] = log.memory if log is not None else {}
        self.terrain: LiveTerrain | None = standing.ground if standing is not None else None

    @property
    def sensors(self) -> tuple[str, ...]:
        """The topics of sensors that the node has now."""
        sensors = self._configuration.parameters.sensors
        return (*sensors.poses, *sensors.clouds)

    @property
    def heard(self) -> list[str]:
        """The topics of sensors that had published before the start; also those whose messages had no answer yet."""
        published = dict.fromkeys((*self.memory.get("heard", ()), *(self.dangers or ())))
        return [topic for topic in published if topic in self.sensors]

    @property
    def missed(self) -> dict[str, int]:
        """The time (ns) at which messages were last lost before the start, by topic of sources."""
        known = (*self.sensors, BY_HAND)
        return {topic: at for topic, at in self.memory.get("missed", {}).items() if topic in known}

    @property
    def places(self) -> Mapping[str, Any]:
        """The saved places of sources, made by `PlaceChecks.to_remember`; empty if they refer to another map origin."""
        return {} if has_moved(self.memory, self.origin) else self.memory.get("places", {})

    @property
    def dangers(self) -> Collection[str] | None:
        """The topics on which danger was possible; None if an older version did not save them."""
        return self.memory.get("dangers")

    @property
    def origin(self) -> tuple[float, float, float]:
        """The origin of the map (m)."""
        return self._configuration.parameters.frame.origin

    @property
    def stamps(self) -> Mapping[str, int]:
        """The last stamps (ns) of terrain and areas, by topic."""
        return self.memory.get("stamps", {})

    def areas(self, watched: Collection[str]) -> list[str]:
        """Return the topics of areas that had an area; watched : topics whose areas have limits in the site file."""
        return [topic for topic in self.memory.get("areas", ()) if topic in watched]

    def refused(self, areas: Collection[str]) -> dict[str, str]:
        """Return why messages of sources and areas were refused, by topic; areas : the topics of areas."""
        known = (*self.sensors, BY_HAND, *areas)
        return {topic: why for topic, why in self.memory.get("refused", {}).items() if topic in known}

    def unjudged(self, areas: Collection[str]) -> dict[str, str]:
        """Return the sentence of the fault of each topic that cannot be judged any more (`unjudged_topics`), by topic.

        areas : the topics of areas
        """
        return unjudged_topics(self.memory, (*self.sensors, BY_HAND, *areas), self.origin)

    def survey(self) -> SurveyInUse:
        """Return the whole survey of the restored terrain or, without a restored terrain, the one that was saved."""
        return survey_in_use(self.terrain, self.memory)

    def replaced_meshes(self) -> Collection[str]:
        """Return the digests of the meshes that were in use before the whole survey in use."""
        return self.memory.get("replaced", ())

    def terrain_lack(self) -> TerrainLack:
        """Return the patches and the whole survey that the restored terrain lacks."""
        log, before = self._configuration.log, self._configuration.before
        alert = log.last_alert if log is not None else None
        shown = lack_of(alert.faults if alert is not None else ())
        remembered = TerrainLack(*self.memory.get("lacks", ()))
        missing = not_restored(self.memory, self.terrain, before.unread)
        # The largest number, because an earlier restart may have counted the same missing patches already.
        patches = max(shown.patches, remembered.patches, before.unread + missing.patches)
        why = shown.why_refused or remembered.why_refused or before.unreadable or missing.why_refused
        return TerrainLack(patches=patches, why_refused=why)

    def terrain_to_remember(self, ground: LiveTerrain | None) -> dict[str, Any]:
        """Return the facts about the terrain to save for the next start, as plain values by name.

        ground : the terrain in use; None if there is none: then the facts from before this start
        """
        return terrain_to_remember(ground, self.memory)
