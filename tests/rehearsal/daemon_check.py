"""Checks the results of tests/rehearsal/daemon.sh: runs at the daemon against the simulation, and each way in which cable, devices or
daemon can fail.

    python3 tests/rehearsal/daemon_check.py FOLDER PROGRAM

See results.py for the arguments.
"""

import json
import sys

from results import code, compare_with_simulation, current_off, failures, folder, goes_on, messages_in, must, report, whole


def unpack_output(name):
    """Stores what a run of the HTTP interface printed in the same files as for a command."""
    pieces = [json.loads(line) for line in (folder / f"{name}.output").read_text().splitlines()]
    printed = lambda kind: "".join(piece[kind] for piece in pieces if kind in piece)
    (folder / f"{name}.json").write_text(printed("stdout"))
    (folder / f"{name}.err").write_text(printed("stderr"))
    (folder / f"{name}.code").write_text(str(pieces[-1]["exit"]))


def state(name):
    return json.loads((folder / f"{name}.state.json").read_text())


def entry(name):
    """A run as the daemon lists it after its end."""
    return json.loads((folder / f"{name}.run.json").read_text())


def exit_code(name):
    return int((folder / f"{name}.serve.code").read_text())


def tripped(name, reason, words=()):
    """A run of the HTTP interface ended by a trip."""
    must(code(name) == 1 and entry(name)["outcome"] == "tripped", f"{name}: exit code 1, listed as tripped")
    whole(name, "tripped", reason, words)
    trip = state(name)["trip"]
    must(trip["reason"] == reason and trip["remedy"], f"{name}: the state says why: {trip['text']}")


def has_fault(name, word):
    fault = state(name)["daemon"]["fault"]
    must(fault and word in fault, f"{name}: the state names the fault: {fault}")


def ends(name):
    """The daemon ends on SIGTERM. Its time is that of the machine, and is not judged."""
    begun, ended = map(float, (folder / f"{name}.serve.times").read_text().split())
    left = (folder / f"{name}.serve.left").read_text()
    must(exit_code(name) == 0 and not left, f"{name}: the daemon ends after {ended - begun:.2f} s and leaves nothing")


def recording_in_progress(name):
    """The recording that was written when a run was cut off or terminated."""
    return folder / (folder / f"{name}.recording").read_text().strip()


def runs_again(name, what):
    goes_on(name, what)
    whole(name, "completed")


def state_in(tick):
    return tick.DESCRIPTOR.fields_by_name["state"].enum_type.values_by_number[tick.state].name


def left_whole(path, what):
    """A recording is complete, every tick is in it, and it ends without current."""
    ticks, events = messages_in(path)
    numbers = [tick.tick for tick in ticks]
    must(numbers == list(range(len(numbers))), f"{what}: {len(numbers)} ticks, none is missing")
    must(ticks[-1].command_a == 0.0 and state_in(ticks[-1]) == "disarmed", f"{what}: it ends disarmed, without current")
    return ticks, events


for output in sorted(folder.glob("*.output")):
    unpack_output(output.stem)

print("a chirp by the command")
compare_with_simulation("chirp")
print("a chirp by the HTTP interface")
compare_with_simulation("chirp_api")
must(entry("chirp_api")["outcome"] == "completed" and entry("chirp_api")["estimated_s"] > 24.0, "it is listed with its length")
print("closed loops")
runs_again("control", "the command completes")
runs_again("control_api", "the run of the HTTP interface completes")
made = [run["command"] for run in json.loads((folder / "well.runs.json").read_text())["finished"]]
must(made == ["control", "chirp", "control", "chirp"], "the daemon made all four runs")
ends("well")
current_off("well")
print("cable out in a run (interface down)")
tripped("cable", "amplifier", ["interface"])
must(state("cable")["loop"]["state"] == "tripped" and state("cable")["loop"]["current_a"] == 0.0, "the state is tripped, zero current")
has_fault("cable", "vcan0")
runs_again("after_cable", "with the cable back the next run completes")
ends("cable")
current_off("cable")
print("cable out between two runs")
has_fault("idle", "vcan0")
must(code("idle_pulled") == 2 and "nothing was moved" in (folder / "idle_pulled.err").read_text(), "a run is refused")
must(state("idle_back")["daemon"]["fault"] is None, "with the cable back the fault is gone")
runs_again("after_idle", "the next run completes")
ends("idle")
current_off("idle")
print("silent probe")
tripped("silence", "probe_stale")
runs_again("after_silence", "the next run completes")
ends("silence")
current_off("silence")
print("devices without power")
tripped("power", "probe_invalid")
has_fault("power", "/run/probe")
runs_again("after_power", "with the devices back the next run completes")
has_fault("power_idle", "/run/probe")
runs_again("after_power_idle", "the same between two runs")
ends("power")
current_off("power_idle")
print("fault of the drive")
tripped("fault", "amplifier", ["continuous over-current"])
has_fault("fault", "--clear-fault")
must(code("uncleared") == 1 and report("uncleared")["trip"]["reason"] == "amplifier", "the next run does not begin")
runs_again("after_fault", "with --clear-fault it completes")
ends("fault")
current_off("fault")
print("SIGKILL of the daemon in a run")
must(exit_code("killed") == 137 and not (folder / "killed.left").read_text(), "the daemon was killed, and its command ended by itself")
current_off("killed_before")
after = state("after_kill.start")
cut = recording_in_progress("killed")
copy = cut.with_name(f"{cut.stem}-recovered.mcap")
reason = after["daemon"]["start_reason"]
must("after a crash" in reason and copy.name in reason, f"the next daemon says why it started: {reason}")
must(after["loop"]["state"] == "disarmed" and not after["run"] and not after["lease"], "it is disarmed, without run and lease")
ticks, _ = messages_in(copy)
done = state("killed")["run"]["progress"]["done"]
must([tick.tick for tick in ticks] == list(range(len(ticks))), f"the cut recording is recovered with {len(ticks)} ticks")
must(len(ticks) >= done - 500, f"at most a second before the last view of tick {done} is lost")
runs_again("after_kill", "the next run completes")
ends("after_kill")
current_off("killed")
print("SIGTERM of the daemon in a run")
ends("terminated")
ticks, events = left_whole(recording_in_progress("terminated"), "its recording")
must(not any(event.kind == "trip" for event in events), "without a trip")
must(any(state_in(tick) == "settling" for tick in ticks), "the current goes to zero along a ramp")
current_off("terminated")
sys.exit(1 if failures else 0)
