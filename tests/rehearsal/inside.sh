#!/bin/sh
# The rehearsal inside the virtual machine: the complete program over vcan0 and a terminal, first without faults, then with each
# way in which a run can end. $1 is the program, $2 a folder for the results. All files are in memory: a file of the host would
# make the machine wait, and its clock leaps while it waits.
set -u
out=$2
here=$(dirname "$0")
mkdir -p /tmp/bench && cp "$1" /tmp/bench/bench && cp "$here"/*.toml /tmp/bench/ && cd /tmp/bench || exit 1
export XDG_STATE_HOME=/tmp/bench/state
ip link add vcan0 type vcan && ip link set vcan0 up || exit 1

# run NAME ARGUMENT...: a run of the bench; report, messages and exit code are stored under this name.
run() {
  name=$1
  shift
  ./bench "$@" --config real.toml --out recordings --json >"$name.json" 2>"$name.err"
  echo $? >"$name.code"
}
act() { ./bench emulate amplifier probe --config real.toml --pty /tmp/probe --log "$1.jsonl" >"$1.out" 2>&1 & device=$!; sleep 1; }
leave() { kill -INT "$device"; wait "$device"; echo $? >"$1.device.code"; }

act well
./bench doctor --config real.toml --json >doctor.json 2>doctor.err
echo $? >doctor.code
run chirp chirp
run swept control --reference chirp --duration 24 --amplitude 50um --set identify.curve=rational --set identify.resolution_ratio=0.0025 --set identify.min_half_width_bins=16
run control control --duration 6 &
first=$!
sleep 3
pgrep -f 'bench control' | head -n 1 >control.pid
run second chirp
wait "$first"
leave well

act killed
run killed control --duration 20 &
sleep 3
pkill -KILL -f 'bench control'
wait $!
sleep 1
run after_kill control
leave killed

act terminated
run terminated control --duration 20 &
sleep 3
pkill -TERM -f 'bench control'
wait $!
leave terminated

act cable
run cable control --duration 20 &
sleep 3
ip link set vcan0 down
wait $!
ip link set vcan0 up
sleep 1
run after_cable control
leave cable

./bench emulate amplifier probe --config real.toml --pty /tmp/probe --fault amplifier.fault=0x2310@1 --log fault.jsonl >fault.out 2>&1 &
device=$!
sleep 1
run fault control
leave fault

rm -f bench
cp -r . "$out/"
