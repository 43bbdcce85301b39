"""Checks the results of tests/rehearsal/commands.sh: the chirp against the simulation, and each way in which a run can end.

    python3 tests/rehearsal/commands_check.py FOLDER PROGRAM

See results.py for the arguments.
"""

import sys

import numpy as np
from results import code, compare_with_simulation, current_off, failures, folder, frf, goes_on, must, over_simulation, recording, report, whole


def compare_under_control():
    """Compares the plant measured in closed loop with the simulation, outside of the modes, whose peaks the averaging of the estimate
    of the simulated chirp lowers.

    Measured in 10 sweeps: at most 0.3 to 0.6 %, and a median of 0.03 %. In one of 10 the emulated probe sends when a command arrives
    (see `must_agree`): at most 1.3 % and a median of 0.06 %. The largest deviation is then that near 36 Hz, where the command is
    small.
    """
    swept = report("swept")
    must(code("swept") in (0, 3) and swept["outcome"] == "completed", "the sweep under control completes")
    must(swept["lost_records"] == 0, "no record is lost")
    f, closed = frf(folder / swept["frf_csv"])
    band = (f >= 2.0) & (f <= 75.0) & (np.abs(f / 29.3 - 1) > 0.2)
    deviation = np.abs(over_simulation(f[band], closed[band]) - 1)
    median, largest = 100 * np.median(deviation), 100 * np.max(deviation)
    what = "the plant is that of the pure simulation from 2 to 75 Hz, outside of the mode at 29.3 Hz"
    must(median < 0.2 and largest < 3.0, f"{what}: within {largest:.3f} %, median {median:.3f} %")


def fault_to_zero(name):
    """No command is recorded from the tick of the trip on."""
    ticks, events = recording(name)
    trip = next(event for event in events if event.kind == "trip")
    after = [tick for tick in ticks if tick.tick >= trip.tick]
    must(all(tick.command_a == 0.0 for tick in after), f"{name}: no command from the tick of the trip on")


print("doctor")
must(code("doctor") == 0 and report("doctor")["ready"], "doctor finds the rehearsal ready")
print("chirp over vcan and a terminal")
compare_with_simulation("chirp")
print("a sweep under control")
compare_under_control()
print("a second bench")
second = (folder / "second.err").read_text()
holder = (folder / "control.pid").read_text().strip()
must(code("second") == 2 and holder in second and "nothing was moved" in second, f"is refused and names process {holder}")
print("closed loop")
goes_on("control", "completes")
whole("control", "completed")
current_off("well")
print("SIGKILL")
must(code("killed") == 137, "the process was killed")
current_off("killed")
goes_on("after_kill", "the next run starts cleanly and completes")
print("SIGTERM")
must(code("terminated") == 1, "exit code 1")
whole("terminated", "stopped")
current_off("terminated")
print("cable out (interface down)")
must(code("cable") == 1, "exit code 1")
whole("cable", "tripped", "amplifier", ["interface"])
current_off("cable")
goes_on("after_cable", "the next run starts cleanly and completes")
print("fault of the drive")
must(code("fault") == 1, "exit code 1")
whole("fault", "tripped", "amplifier", ["continuous over-current"])
fault_to_zero("fault")
current_off("fault")
sys.exit(1 if failures else 0)
