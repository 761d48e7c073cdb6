#!/bin/sh
# Programs with long timers: `understudy verify` compared with NuSMV 2.5.4 -dynamic, processor time of both in one run.
#
#   engineering/verification/benches/nusmv.sh NUSMV [UNDERSTUDY]
#
# NUSMV is the binary of the peer, UNDERSTUDY that of this project (default: target/release/understudy). SECONDS_MAX limits each run (default 120).
# A run of understudy includes the standard properties and the remarks, which NuSMV is not asked for. `understudy verify` ends with 0 if all is proved.
#
# The peer is in the source package of pynusmv (build tools, flex, bison and libreadline-dev, libexpat1-dev are needed):
#
#   pip download --no-deps --no-binary :all: pynusmv && tar xf pynusmv-*.tar.gz
#   cd pynusmv-*/dependencies/NuSMV && tar xf NuSMV-2.5.4.tar.gz && cd NuSMV-2.5.4/cudd-2.4.1.1
#   sed -i 's/union wait status/int status/; s/status\.w_status/status/' util/pipefork.c
#   make -f Makefile_64bit ICFLAGS="-O3 -std=gnu89 -fcommon -w"
#   cd ../nusmv && ./configure --disable-minisat --disable-zchaff CFLAGS="-O3 -std=gnu89 -fcommon -w" && make
set -eu
nusmv=${1:-${NUSMV:?the binary of NuSMV}}
understudy=${2:-${UNDERSTUDY:-target/release/understudy}}
limit=${SECONDS_MAX:-120}
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT

# The preset of timer $2, in scans, in the family of presets $1.
preset() {
    case $1 in
        equal) echo 4000 ;;
        short) echo 300 ;;
        mixed) echo "700 1500 4000 2300 350 3100 900 1999 2750 1234" | cut -d ' ' -f $(($2 + 1)) ;;
    esac
}

# On-delays in a row: each begins when the one before it is over.
chain() {
    printf 'program chain\n\ninput start\ninput stop\n\n'
    for i in $(seq 0 $(($1 - 1))); do echo "output y$i"; done
    printf 'memory y\n\nrung\n    [ start | y ] /stop ( y )\n'
    before=y
    for i in $(seq 0 $(($1 - 1))); do
        printf 'rung\n    %s {TON t%d %dms} ( y%d )\n' $before "$i" "$(preset "$2" "$i")" "$i"
        before=y$i
    done
}

# Independent on-delays and off-delays, and outputs that need all of them.
product() {
    printf 'program product\n\n'
    for i in $(seq 0 $(($1 - 1))); do printf 'input u%d\nmemory m%d\n' "$i" "$i"; done
    printf 'output all\noutput any\noutput first\n'
    all='' any='' none=''
    for i in $(seq 0 $(($1 - 1))); do
        kind=TON
        [ $((i % 2)) = 1 ] && kind=TOF
        printf 'rung\n    u%d {%s t%d %dms} ( m%d )\n' "$i" $kind "$i" "$(preset "$2" "$i")" "$i"
        all="$all m$i" any="$any${any:+ |} m$i"
        [ "$i" = 0 ] || none="$none /m$i"
    done
    printf 'rung\n   %s ( all )\nrung\n    [ %s ] ( any )\nrung\n    m0%s ( first )\n' "$all" "$any" "$none"
}

# Three off-delays of four seconds in parallel, and an alarm that needs them all.
alarm() {
    printf 'program alarm\n\ninput left\ninput middle\ninput right\ninput reset\n\noutput gate\noutput lamp\noutput horn\n\nmemory alarm\n'
    printf 'rung\n    [ left {TOF a 4s} | middle {TOF b 4s} | right {TOF c 4s} ] ( gate )\nrung\n    a.Q b.Q c.Q ( S alarm )\n'
    printf 'rung\n    reset /gate ( R alarm )\nrung\n    alarm gate ( lamp )\nrung\n    alarm /left ( horn )\n'
}

# Processor time of a command in seconds, or the limit where it did not end; its output is in $folder/out.
seconds() {
    ( ulimit -t "$limit"; "$@" >"$folder/out" 2>&1 ) || true
}

measure() {
    name=$1 ladder=$folder/$1.ladder
    set --
    for output in $(sed -n 's/^output //p' "$ladder"); do
        set -- "$@" --property "AG EF $output" --property "AG EF !$output"
    done
    "$understudy" verify "$ladder" --period 1ms "$@" --smv scan --output "$folder/model.smv" >/dev/null
    # `times` tells the time of the children that have ended, in its second line.
    peer=$( (seconds "$nusmv" -dynamic "$folder/model.smv"; grep -c 'is true' "$folder/out" >"$folder/true" || true; times) | sed -n 2p)
    ours=$( (seconds "$understudy" verify "$ladder" --period 1ms "$@"; times) | sed -n 2p)
    echo "$name $(($# / 2)) $(cat "$folder/true") $peer $ours" | awk '
        function time(text) { split(text, part, /[ms]/); return 60 * part[1] + part[2] }
        { peer = time($4) + time($5); ours = time($6) + time($7)
          printf "%-18s %10d %10d %10.2f s %10.2f s %8.3f\n", $1, $2, $3, peer, ours, ours / peer }'
}

echo "program            properties  by NuSMV        NuSMV   understudy    ratio"
alarm >"$folder/alarm.ladder"
measure alarm
for timers in 3 5 7 10; do
    for presets in short mixed equal; do
        for family in chain product; do
            $family $timers $presets >"$folder/${family}_${timers}_$presets.ladder"
            measure "${family}_${timers}_$presets"
        done
    done
done
