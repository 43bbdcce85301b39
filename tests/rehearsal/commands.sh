#!/bin/sh
# The commands inside the virtual machine, over vcan0 and a terminal, first without faults, then with each way in which a run can
# end. See common.sh for the arguments.
. "$(dirname "$0")/common.sh"

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

act fault --fault amplifier.fault=0x2310@1
run fault control
leave fault

store
