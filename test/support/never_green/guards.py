"""Remove each guard of the safety argument in a copy of the package, and check that the campaign finds a failure.

    PYTHONPATH=test/support:. python -m never_green.guards               all guards
    PYTHONPATH=test/support:. python -m never_green.guards 1.2 4         only guards whose line begins with 1.2 or 4
    PYTHONPATH=test/support:. python -m never_green.guards --list        the list of docs/explanation/never-green.md

A guard is a piece of code that prevents too low a level. It is removed by a change of exact text that occurs once in a
file. `line` is the line of the safety argument that names the guard.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[3]
COPIED = ("rpf3d_core", "rpf3d_ros", "test/support", "config")
COMBINATIONS = 100
"""Number of combinations with the defects of a guard; the first combination that fails ends the search."""

LONGEST = 900.0
"""Time (s) after which the search for a failure ends with an error."""

ENGINE, ROS_ALERTS = "rpf3d_ros/engine", "rpf3d_ros/alerts"
LIVE, CORE_ALERTS = "rpf3d_core/live", "rpf3d_core/alerts"
MESSAGES, NODES = "rpf3d_ros/messages", "rpf3d_ros/nodes"


class Guard(NamedTuple):
    """A guard of the safety argument, and the change of code that removes the guard.

    line : number of the line in the argument; guard : effect of the guard, in words
    file, text, becomes : the changed file, the text to replace, and the new text
    kinds : kinds of defects against which the guard acts, separated by commas
    also : `guard` of another guard that covers the same defects and is removed at the same time; "" for none
    """

    line: str
    guard: str
    file: str
    text: str
    becomes: str
    kinds: str
    also: str = ""


GUARDS = (
    Guard("1.1", "a message of sources that was not understood is a fault", f"{ENGINE}/station.py",
          "        self._refused_inputs.refused(topic, why, time.monotonic())\n", "        return\n",
          "partly understood"),
    Guard("1.1", "the fault of a refused message lasts while its topic has two publishers",
          f"{ROS_ALERTS}/refused_inputs.py",
          "if refusal is None or speakers() > 1:", "if refusal is None:",
          "two speakers,alternately understood", also="two publishers of one topic are a fault"),
    Guard("1.2", "a message without sources removes only sources of its own topic", f"{ROS_ALERTS}/region_evidence.py",
          "return other.topic == self.topic and other.stamp_ns < self.stamp_ns",
          "return other.stamp_ns < self.stamp_ns", "contradicting,acknowledged early"),
    Guard("1.2", "of two messages with the same stamp, the message with sources counts",
          f"{ROS_ALERTS}/region_evidence.py",
          "other.stamp_ns < self.stamp_ns", "other.stamp_ns <= self.stamp_ns", "contradicting itself",
          also="a message without sources that has the stamp of sources is not simulated"),
    Guard("1.2", "a message without sources that has the stamp of sources is not simulated",
          f"{ROS_ALERTS}/unreported_places.py",
          "return Update(None if len(known.reported) else trigger)", "return Update(trigger)", "contradicting itself",
          also="of two messages with the same stamp, the message with sources counts"),
    Guard("1.2", "no part of a scan replaces a source of another part", f"{ROS_ALERTS}/unreported_places.py",
          "    is_part = (known.at_ns == stamp_ns) & (stamp_ns > 0)", "    is_part = np.zeros(len(known), dtype=bool)",
          "scan in parts"),
    Guard("1.2", "an empty part of a scan ends no place", f"{ROS_ALERTS}/unreported_places.py",
          "        if is_resumed and len(known.before_empty):\n", "        if False:\n",
          "scanning by turns,scan in parts"),
    Guard("1.2", "without a scan period, a part is simulated together with the parts before it",
          f"{ROS_ALERTS}/unreported_places.py", "            new = parts.and_also(new)\n", "", "scan in parts"),
    Guard("1.2", "each click is a separate region", f"{ENGINE}/waiting_sources.py",
          "        if trigger.topic == BY_HAND:\n", "        if False:\n", "acknowledged early,duplicated"),
    Guard("1.3", "a point cloud of NaN does not mean that no source was seen", f"{MESSAGES}/source_messages.py",
          "    if not bool(there.any()):\n", "    if False:\n", "nothing but NaN"),
    Guard("1.3", "a message with a pose that is not finite is refused", f"{MESSAGES}/source_reading.py",
          "    _check_poses(at, axes)\n",
          "    there = np.isfinite(at).all(axis=1)\n    at, axes = at[there], axes[there]\n", "not finite"),
    Guard("1.4", "a source that cannot be released is a fault", f"{ROS_ALERTS}/answer_evidence.py",
          "(answer.left_out, answer.doubtful)", "(answer.doubtful,)", "one misplaced"),
    Guard("1.4", "a message is a fault if none of its sources can be released", f"{ENGINE}/answer_reports.py",
          "            self._report_refused(why)\n        self._decide_without_answer(trigger, why)\n",
          "            self._report_refused(why)\n", "never released"),
    Guard("1.6", "a topic that falls silent is a fault", f"{ROS_ALERTS}/source_topics.py",
          "            if stamp < oldest_ns\n", "            if False\n", "missing sources,late sources",
          also="a decision is valid only until a topic would be silent"),
    Guard("1.6", "a decision is valid only until a topic would be silent", f"{ROS_ALERTS}/region_evidence.py",
          "        silent_ns = [] if first_ns is None else [first_ns + self._max_age_ns]\n",
          "        silent_ns: list[int] = []\n", "missing sources,late sources",
          also="a topic that falls silent is a fault"),
    Guard("1.6", "an expected topic on which no message was published is a fault", f"{ROS_ALERTS}/source_topics.py",
          "        never = [topic for topic in self._expected if topic not in self._last]\n", "        never = []\n",
          "never published"),
    Guard("1.6", "a topic that was received before the clock went back must be received again",
          f"{ROS_ALERTS}/source_topics.py",
          "        self._heard = dict.fromkeys((*self._heard, *self._last), ANY_STAMP)\n", "",
          "missing sources,clock back"),
    Guard("1.8", "a connected sensor that never published is a fault", f"{ENGINE}/publisher_watch.py",
          "if name not in self._understood and each.last - each.since > self._longest", "if False",
          "connected and mute"),
    Guard("1.13", "a place that its topic no longer reports is a fault if rocks from there may reach a limit",
          f"{ROS_ALERTS}/unreported_evidence.py",
          "return {topic: fault for topic, fault in found.items() if fault}", "return {}", "scanning by turns"),
    Guard("1.13", "places that are no longer reported are simulated again over changed terrain",
          f"{ENGINE}/answered_sources.py", "(one.is_unreported or one.stamp_ns >= oldest_ns)",
          "(not one.is_unreported and one.stamp_ns >= oldest_ns)", "scanning by turns",
          also="an answer over the former terrain to a place that is no longer reported is a fault"),
    Guard("1.13", "an answer over the former terrain to a place that is no longer reported is a fault",
          f"{ROS_ALERTS}/region_evidence.py",
          "            parts, grounds = [*parts, *unreported], [*grounds, *unreported]\n", "", "scanning by turns",
          also="places that are no longer reported are simulated again over changed terrain"),
    Guard("1.13", "a place that is no longer reported is remembered after a restart", f"{ROS_ALERTS}/place_checks.py",
          "        places, lacking = self._places.restore(saved, topics, time.monotonic())\n", "        return\n",
          "scanning by turns,restarted"),
    Guard("1.14", "places of earlier messages count until the scan period is over",
          f"{ROS_ALERTS}/unreported_places.py",
          "        before = before.younger_than(period_ns, trigger.stamp_ns, now_s) if period_ns else NOWHERE\n",
          "        before = NOWHERE\n", "scanning by turns"),
    Guard("1.14", "a refused message is a fault until every place has been reported again", f"{ENGINE}/station.py",
          "max(age, period or 0.0), persons", "age, persons", "scanning by turns"),
    Guard("1.14", "a clock that jumps ahead ends no place of a scan", f"{ROS_ALERTS}/unreported_places.py",
          " | (now_s - self.at_s <= period_ns / NS)", "", "scanning by turns,clock ahead",
          also="a scan begins again after a pause or a jump of the clock"),
    Guard("1.14", "a scan begins again after a pause or a jump of the clock", f"{ROS_ALERTS}/first_scans.py",
          "if known is None or pause_ns > self._longest_ns:", "if known is None:", "scanning by turns,clock ahead",
          also="a clock that jumps ahead ends no place of a scan"),
    Guard("2.1", "a survey that was refused is a fault", f"{ENGINE}/station.py",
          '        self.report_fault("surveys", lack.survey_sentence)\n', "", "survey not understood",
          also="a survey that is too old is a fault"),
    Guard("2.1", "a patch that was refused is a fault", f"{ENGINE}/station.py",
          '        self.report_fault("patches", lack.patches_sentence)\n', "", "patch not understood",
          also="a survey that is too old is a fault"),
    Guard("2.1", "a patch that reaches far beyond the ground is refused", f"{LIVE}/patched_arrays.py",
          "    if RELATIVE_TOLERANCE * math.dist(low, high) > WIDER * facets.tolerance:\n", "    if False:\n",
          "wrong heights of a patch"),
    Guard("2.2", "a source far above the ground is a fault", f"{ROS_ALERTS}/answer_evidence.py",
          "(answer.left_out, answer.doubtful)", "(answer.left_out,)", "mirrored survey"),
    Guard("2.3", "rocks that left the terrain and may reach an area are a fault", f"{CORE_ALERTS}/evidence_faults.py",
          "    if is_hidden or (area.left and area.left / area.flown > terms.most_left):\n", "    if False:\n",
          "strip of holes"),
    Guard("2.4", "an area without terrain is a fault", f"{CORE_ALERTS}/evidence_faults.py",
          "    if area.uncovered > terms.most_uncovered:\n", "    if False:\n", "cut survey,wrong unit,wrong sign"),
    Guard("2.8", "a mesh that is published again is recognised by its bytes", f"{ENGINE}/survey_in_use.py",
          "        return arrival.is_mesh and arrival.mesh.repeats(self.mesh)\n", "        return False\n",
          "mesh after the patch", also="a survey that is published again is recognised by its digest"),
    Guard("2.8", "a survey that is published again is recognised by its digest", f"{ENGINE}/survey_in_use.py",
          "        return bool(digest) and digest == self.digest and (", "        return False and (",
          "same mesh in other bytes", also="a mesh that was in use before is refused"),
    Guard("2.8", "a mesh that was in use before is refused", f"{ENGINE}/builder.py",
          "        if arrival.is_mesh and not repeats and ground.digest in self._replaced:\n", "        if False:\n",
          "former mesh again"),
    Guard("2.10", "a survey with heights that mean no data is refused", f"{LIVE}/ground.py",
          "            check_heights(terrain, facets.corners, facets.normals, self._tallest)\n", "",
          "no data as a height"),
    Guard("2.10", "a grid that folds back over itself is refused", f"{LIVE}/ground.py",
          "                check_no_fold(terrain, facets.normals, survey.points)\n", "                pass\n",
          "folded survey"),
    Guard("3.1", "a level is decided for each cluster of sources", f"{ENGINE}/station.py",
          "        cluster = terms.cluster_m if terms is not None else math.inf\n", "        cluster = math.inf\n",
          "diluted"),
    Guard("3.2", "the worst region counts", f"{ROS_ALERTS}/region_evidence.py",
          "        known = self._outlines.described(together(parts))\n",
          "        known = self._outlines.described(parts[-1])\n", "acknowledged early,contradicting"),
    Guard("4.1", "a survey that is too old is a fault", f"{CORE_ALERTS}/evidence_faults.py",
          "        elif longest is not None and age > ns_of(longest):\n", "        elif False:\n",
          "missing surveys", also="a decision is valid only until its evidence is too old"),
    Guard("4.1", "a decision is valid only until its evidence is too old", f"{CORE_ALERTS}/decide.py",
          "    until = min(until, *fresh, ", "    until = min(until, until, ",
          "missing surveys", also="a survey that is too old is a fault"),
    Guard("4.1", "a patch does not renew the age of the whole survey", f"{LIVE}/ground.py",
          "digest, ground.whole_digest, stamp_ns=stamp_ns, whole_ns=ground.whole_ns, ",
          "digest, ground.whole_digest, stamp_ns=stamp_ns, whole_ns=stamp_ns, ",
          "missing surveys"),
    Guard("4.2", "a message that is older than the last message of its topic is refused", f"{ENGINE}/stamp_guards.py",
          "        if stamp_ns < last:\n", "        if False:\n", "former area again"),
    Guard("4.2", "after the clock went back a little, older messages are refused", f"{ENGINE}/stamp_guards.py",
          "topic: min(stamp_ns, now_ns) for", "topic: 0 * min(stamp_ns, now_ns) for",
          "old patch after a small step,old area after a small step"),
    Guard("4.2", "a stamp from the future is a fault", f"{CORE_ALERTS}/evidence_faults.py",
          "        if age < -ahead:\n", "        if False:\n", "clock back over old terrain"),
    Guard("4.2", "a stamp beyond the site's clock tolerance is refused", f"{ENGINE}/configuration.py",
          "        return min(self.parameters.most_ahead, self.thresholds.evidence.clock_tolerance_s)\n",
          "        return self.parameters.most_ahead\n", "early before silence"),
    Guard("4.2", "an answer that is older than its sources is a fault", f"{CORE_ALERTS}/evidence_faults.py",
          "    if evidence.at_ns < evidence.trigger_stamp_ns - ahead:\n", "    if False:\n", "early until a survey",
          also="a stamp beyond the site's clock tolerance is refused"),
    Guard("4.3", "a clock that stands still is a fault", f"{NODES}/simulator.py",
          '            self.station.report_fault("clock", STANDS if stands else "")\n', "            pass\n",
          "clock stands in silence"),
    Guard("4.3", "after the clock went back, earlier evidence does not count", f"{NODES}/simulator.py",
          "        if now < self._ticked:\n", "        if False:\n", "clock back in silence"),
    Guard("4.4", "no level is decided before the clock runs", f"{ROS_ALERTS}/alert_desk.py",
          "        if not self._clock_ran:\n", "        if False:\n", "silence without a clock",
          also="a stamp of 0 is a fault"),
    Guard("4.4", "a stamp of 0 is a fault", f"{CORE_ALERTS}/evidence_faults.py",
          "        if stamp == 0:\n", "        if False:\n", "silence without a clock",
          also="no level is decided before the clock runs"),
    Guard("5.1", "a publisher that cannot be received is a fault", f"{ENGINE}/publisher_watch.py",
          "            if why := _misfit(topic, each):\n", "            if False and (why := _misfit(topic, each)):\n",
          "not received"),
    Guard("5.2", "two publishers of one topic are a fault", f"{ENGINE}/publisher_watch.py",
          "        if topic.is_single and len(fitting) > 1:\n", "        if False:\n", "two speakers"),
    Guard("6", "a level falls only by an acknowledgement", f"{CORE_ALERTS}/decide.py",
          "    return _Held(level=before, by=previous.held_by, ", "    return _Held(level=evident, by=sentences, ",
          "none"),
    Guard("7.2", "after a restart, areas and patches with older stamps than before are refused", f"{ENGINE}/station.py",
          '        self.guards.continue_from(self._before.stamps)\n', "", "old area after a restart"),
    Guard("7.2", "a patch that is older than the restored terrain is refused", f"{ENGINE}/station.py",
          "        if restored is not None:  # patches", "        if False:  # patches", "old patch after a restart",
          also="after a restart, areas and patches with older stamps than before are refused"),
    Guard("7.1", "if the computation of an answer fails, the level is a fault", f"{ENGINE}/answer_reports.py",
          "            if trigger is None:\n                desk.lose(why)\n            else:\n",
          "            if False:\n", "answers fail"),
    Guard("7.1", "a region whose answer failed stays a fault until it is answered", f"{ENGINE}/answer_reports.py",
          "                self._decide_without_answer(trigger, why)\n", "                pass\n", "answers fail"),
)  # fmt: skip


def copy_of(folder: Path) -> Path:
    """Copy the code and configuration that the campaign needs into a folder, and return the folder."""
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
    return folder


def taken_with(guard: Guard) -> list[Guard]:
    """Return a guard and the guards that are removed at the same time, following `also` from guard to guard."""
    taken = [guard]
    while more := [each for each in GUARDS if each.guard == taken[-1].also and each not in taken]:
        taken += more
    return taken


def found_without(guard: Guard, folder: Path) -> str:
    """Remove a guard in a copy of the package, and return the campaign's first failure as text; "" if there is none.

    Afterwards the copy is restored, so that code compiled for the copy can be used again.
    """
    taken = taken_with(guard)
    before = {folder / each.file: (folder / each.file).read_text() for each in taken}
    for each in taken:
        source = (folder / each.file).read_text()
        if source.count(each.text) != 1:
            raise SystemExit(f"{each.file} holds {source.count(each.text)} times: {each.text!r}")
        (folder / each.file).write_text(source.replace(each.text, each.becomes))
    try:
        return first_failure(folder, guard.kinds)
    finally:
        for path, source in before.items():
            path.write_text(source)


def first_failure(folder: Path, kinds: str) -> str:
    """Run the campaign in a copy of the package, and return the first line on a failure; "" if there is none."""
    command = [sys.executable, "-m", "never_green.campaign", "--count", str(COMBINATIONS), "--kinds", kinds]
    environment = os.environ | {"PYTHONPATH": f"{folder / 'test/support'}:{folder}", "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [*command, "--until-failed", "--workers", "1"], cwd=folder, env=environment, capture_output=True, text=True,
        timeout=LONGEST,
    )  # fmt: skip
    if done.returncode not in (0, 1):
        raise RuntimeError(done.stderr)
    return next((line for line in done.stdout.splitlines() if line.startswith("seed ")), "")


def listed() -> str:
    """Return the guards as a list in Markdown: line of the argument, guard, file, guard that is also removed."""
    items = [
        f"- **{one.line}** {one.guard}: `{one.file}`." + (f" Also removed: {one.also}." if one.also else "")
        for one in GUARDS
    ]
    return "\n".join(
        textwrap.fill(item, 120, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
        for item in items
    )


def main(chosen: list[str], folder: Path) -> int:
    """Remove the guards one after the other in a copy in a folder; return 1 if the campaign misses one.

    chosen : beginnings of the `line` of the guards to test; empty for all guards
    """
    guards = [each for each in GUARDS if not chosen or each.line.startswith(tuple(chosen))]
    missed = 0
    copy_of(folder)
    for guard in guards:
        line = found_without(guard, folder)
        missed += not line
        print(f"{guard.line} {guard.guard}: {line or 'NOT FOUND'}", flush=True)
    print(f"{len(guards) - missed} of {len(guards)} guards are found by the campaign when they are taken away")
    return int(missed > 0)


if __name__ == "__main__":
    if sys.argv[1:] == ["--list"]:
        print(listed())
    else:
        with tempfile.TemporaryDirectory() as name:
            sys.exit(main(sys.argv[1:], Path(name)))
