#!/bin/sh
# What the page of a run costs: the press cell at 10 ms for a minute, with so many viewers of the page and so many connections that ask it
# for the state as fast as they are answered (wrk, of Debian's package of that name).
#
#   observation/watch/benches/cost.sh target/release/understudy 50 64
#
# It prints the share of a core that each member uses over half a minute, what wrk has reached, and what the run came to.
set -eu
understudy=$(realpath "$1")
viewers=$2
connections=$3
seconds=30
port=7499
cell=$(realpath "$(dirname "$0")/../../../examples/press-cell/cluster.toml")
folder=$(mktemp -d)
cd "$folder"

"$understudy" lab "$cell" --link udp --cycles 6000 --watch 127.0.0.1:$port > result 2> said < /dev/null &
laboratory=$!
trap 'kill $laboratory $told 2> /dev/null || true; rm -rf "$folder"' EXIT
told=
until grep -q "synchronised: " said; do kill -0 $laboratory; sleep 0.2; done

for viewer in $(seq "$viewers"); do
    curl -sN http://127.0.0.1:$port/api/live > /dev/null &
    told="$told $!"
done

used() {
    for process in $(pgrep -P $laboratory); do
        name=$(tr '\0' '\n' < "/proc/$process/cmdline" | grep -A 1 '^--name$' | tail -1)
        echo "$name $(awk '{ print $14 + $15 }' "/proc/$process/stat")"
    done
    echo "page $(awk '{ print $14 + $15 }' "/proc/$laboratory/stat")"
}

used > before
if [ "$connections" -gt 0 ]; then
    wrk -t 2 -c "$connections" -d ${seconds}s --latency http://127.0.0.1:$port/api/state > asked &
    asking=$!
fi
sleep $seconds
used > after
paste before after | awk -v seconds=$seconds -v tick="$(getconf CLK_TCK)" \
    '{ printf "%-12s %.2f %% of a core\n", $1, ($4 - $2) / tick / seconds * 100 }'
if [ "$connections" -gt 0 ]; then
    wait $asking
    grep -E "Requests/sec|99%" asked
fi
for one in $told; do kill "$one" 2> /dev/null || true; done
told=
wait $laboratory || true
grep -E "direct|passed|FAILED" result
