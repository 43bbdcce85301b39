#!/bin/sh
# The commands inside the virtual machine, over vcan0 and a terminal, first without faults, then with each way in which a run can
# end. See common.sh for the arguments.
. "$(dirname "$0")/common.sh"

act well
run chirp chirp
./bench doctor --config real.toml --set "control.certificate=$(ls recordings/*_certificate.json)" --json >doctor.json 2>doctor.err
echo $? >doctor.code
closed swept --reference chirp --duration 24 --amplitude 50um --set identify.curve=rational --set identify.resolution_ratio=0.0025 --set identify.min_half_width_bins=16
closed control --duration 6 &
first=$!
sleep 3
pgrep -f 'bench control' | head -n 1 >control.pid
run second chirp
wait "$first"
leave well

act killed
closed killed --duration 20 &
sleep 6
pkill -KILL -f 'bench control'
wait $!
sleep 1
closed after_kill
leave killed

act terminated
closed terminated --duration 20 &
sleep 6
pkill -TERM -f 'bench control'
wait $!
leave terminated

act cable
closed cable --duration 20 &
sleep 6
ip link set vcan0 down
wait $!
ip link set vcan0 up
sleep 1
closed after_cable
leave cable

act fault --fault amplifier.fault=0x2310@4
closed fault --duration 10
leave fault

store
