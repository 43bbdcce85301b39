#!/bin/sh
# The daemon inside the virtual machine, on vcan0 and a terminal: runs by the commands and by the HTTP interface, and each way in
# which cable, devices or daemon can fail. See common.sh for the arguments. `curl` is that of the host.
. "$(dirname "$0")/common.sh"
export BENCH_SOCKET=/run/rehearsal/bench.sock
mkdir lib && cp "$(command -v curl)" lib/ && ldd lib/curl | awk '/=> \// { print $3 }' | xargs -I{} cp {} lib/ || exit 1

# api METHOD PATH [ARGUMENT...]: one request to the daemon.
api() {
  method=$1 path=$2
  shift 2
  LD_LIBRARY_PATH=lib lib/curl --silent --show-error --unix-socket "$BENCH_SOCKET" --request "$method" "http://bench/api/v1$path" "$@"
}
state() { api GET /state >"$1.state.json" 2>"$1.state.err"; }
uptime_s() { cut -d' ' -f1 /proc/uptime; }

# await TEXT: waits until the state contains a text, at most 20 s.
await() {
  tries=0
  until api GET /state 2>/dev/null | grep -q -e "$1" || [ $tries -ge 40 ]; do
    tries=$((tries + 1))
    sleep 0.5
  done
}

# serve NAME: the daemon, until its devices are open.
serve() {
  ./bench serve --config real.toml --out recordings >"$1.serve.out" 2>"$1.serve.err" &
  daemon=$!
  await '"amplifier":"'
  state "$1.start"
}

# end NAME: ends the daemon by SIGTERM. Stores its exit code, the time it took, and what is left of it.
end() {
  begun=$(uptime_s)
  kill -TERM "$daemon"
  wait "$daemon"
  echo $? >"$1.serve.code"
  echo "$begun $(uptime_s)" >"$1.serve.times"
  sleep 1
  { pgrep -fa 'bench (serve|control|chirp)'; ls "$BENCH_SOCKET"; ls recordings/.bench-daemon.lock; } >"$1.serve.left" 2>/dev/null
}

# newest NAME: stores the name of the newest recording.
newest() { ls -t recordings/*.mcap | head -n 1 >"$1.recording"; }

# order NAME COMMAND [--OPTION=VALUE...]: starts a run by the HTTP interface. `follow NAME` waits for its end.
order() {
  name=$1 command=$2
  shift 2
  options=
  for option in "$@"; do options="$options,$(echo "$option" | sed 's/^--\([^=]*\)=\(.*\)$/"\1":"\2"/')"; done
  api POST /lease --json '{"operator":"rehearsal"}' >"$name.lease.json"
  lease=$(sed 's/.*"lease":"\([^"]*\)".*/\1/' "$name.lease.json")
  api POST /runs --header "Bench-Lease: $lease" \
    --json "{\"command\":\"$command\",\"json\":true$options,\"name\":\"$name\",\"on_disconnect\":\"continue\"}" >"$name.order.json"
  id=$(sed 's/.*"id":\([0-9]*\),.*/\1/' "$name.order.json")
}
follow() {
  api GET "/runs/$id/output" >"$1.output"
  sleep 1
  api GET "/runs/$id" >"$1.run.json"
  api DELETE /lease --header "Bench-Lease: $lease" >/dev/null # it may have expired
}

# resume: a trip holds the bench until somebody resumes.
resume() { ./bench resume >"$1.resume.out" 2>"$1.resume.err"; }

well() {
  act well
  serve well
  run chirp chirp
  closed control --duration 6
  order chirp_api chirp
  follow chirp_api
  order control_api control "$(evidence "")" --duration=6
  follow control_api
  api GET /runs >well.runs.json
  end well
  leave well
}

# The cable is pulled in a run.
cable() {
  act cable
  serve cable
  order cable control "$(evidence "")" --duration=20
  sleep 6
  ip link set vcan0 down
  follow cable
  await 'vcan0 is down'
  state cable
  ip link set vcan0 up
  await '"amplifier":"'
  resume after_cable
  closed after_cable
  end cable
  leave cable
}

# The cable is pulled between two runs.
idle() {
  act idle
  serve idle
  ip link set vcan0 down
  await 'vcan0 is down'
  state idle
  closed idle_pulled
  ip link set vcan0 up
  await '"fault":null'
  state idle_back
  closed after_idle
  end idle
  leave idle
}

# The probe is silent for three seconds.
silence() {
  act silence --fault probe.silence@4s..7s
  serve silence
  order silence control "$(evidence "")" --duration=20
  follow silence
  state silence
  await '"position_m":[-0-9]'
  resume after_silence
  closed after_silence
  end silence
  leave silence
}

# Both devices lose their power, and the terminal of the probe disappears: first in a run, then between two runs.
power() {
  act power
  serve power
  order power control "$(evidence "")" --duration=20
  sleep 6
  kill -KILL "$device"
  follow power
  await 'there is no such port'
  state power
  act power_back
  await '"amplifier":"'
  resume after_power
  closed after_power
  kill -KILL "$device"
  await 'there is no such port'
  state power_idle
  act power_idle
  await '"amplifier":"'
  closed after_power_idle
  end power
  leave power_idle
}

# The drive reports a fault, which the operator must clear.
fault() {
  act fault --fault amplifier.fault=0x2310@4s..5s
  serve fault
  order fault control "$(evidence "")" --duration=20
  follow fault
  await '--clear-fault'
  state fault
  resume uncleared
  closed uncleared
  closed after_fault --clear-fault
  end fault
  leave fault
}

# The daemon is killed in a run.
killed() {
  act killed
  serve killed
  order killed control "$(evidence "")" --duration=20
  sleep 7
  state killed
  newest killed
  kill -KILL "$daemon"
  wait "$daemon"
  echo $? >killed.serve.code
  sleep 1
  pgrep -fa 'bench (serve|control)' >killed.left
  cp killed.jsonl killed_before.jsonl
  serve after_kill
  closed after_kill
  end after_kill
  leave killed
}

# The daemon is terminated in a run.
terminated() {
  act terminated
  serve terminated
  order terminated control "$(evidence "")" --duration=20
  sleep 7
  state terminated
  newest terminated
  end terminated
  leave terminated
}

shift 2
for scene in ${*:-well cable idle silence power fault killed terminated}; do
  $scene
done
store
