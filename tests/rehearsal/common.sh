# Sourced by the scripts inside the virtual machine: $1 is the program, $2 a folder for the results. All files are in memory: a
# file of the host would make the machine wait, and its clock leaps while it waits.
set -u
out=$2
mkdir -p /run/rehearsal && cp "$1" /run/rehearsal/bench && cp "$(dirname "$0")"/*.toml /run/rehearsal/ && cd /run/rehearsal || exit 1
export XDG_STATE_HOME=/run/rehearsal/state
ip link add vcan0 type vcan && ip link set vcan0 up || exit 1

# run NAME ARGUMENT...: a run of the bench; report, messages and exit code are stored under this name.
run() {
  name=$1
  shift
  ./bench "$@" --config real.toml --out recordings --json >"$name.json" 2>"$name.err"
  echo $? >"$name.code"
}

# evidence [FOLDER/]: the option with which a loop closes: the certificate of the first chirp, by its path in this folder; a reason
# without one, if a scene is rehearsed alone.
evidence() {
  found=$(ls recordings/*_certificate.json 2>/dev/null | head -n 1)
  if [ -n "$found" ]; then
    echo "--certificate=${1-recordings/}${found##*/}"
  else
    echo "--override=rehearsal of a single scene"
  fi
}

# closed NAME [ARGUMENT...]: a closed loop. The stage is checked before it, which takes about two seconds.
closed() {
  loop=$1
  shift
  run "$loop" control "$(evidence)" "$@"
}

# act NAME [OPTION...]: emulated amplifier and probe. Like real devices they do not wait for the program that uses them, except for its
# loop, whose priority is higher: with one of ordinary processes, three commands of 22,000 arrived 0.15 ms late.
act() {
  log=$1
  shift
  rm -f /run/probe # of an emulator that was killed
  chrt --fifo 70 ./bench emulate amplifier probe --config real.toml --pty /run/probe --log "$log.jsonl" "$@" >"$log.out" 2>&1 &
  device=$!
  sleep 1
}
leave() { kill -INT "$device"; wait "$device"; echo $? >"$1.device.code"; }

# store: the results, for the checks on the host.
store() {
  rm -f bench
  cp -r . "$out/"
}
