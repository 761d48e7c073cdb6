# Runs a command inside a root file system, as a process that ends with this one, without a network and without a view of this machine.
# Called as `inside.sh ROOT FOLDER USER GROUP COMMAND...`, where FOLDER is inside of ROOT.
set -e
if [ "$1" != inside ]; then
    exec unshare --fork --kill-child --pid --mount --net --ipc --uts sh "$0" inside "$@"
fi
shift
root=$1 folder=$2 user=$3 group=$4
shift 4
mount --make-rprivate /
mkdir -p "$root/proc" "$root/dev"
mount -t proc proc "$root/proc"
mount -t tmpfs -o mode=755 tmpfs "$root/dev"
for device in null zero full random urandom tty; do
    : > "$root/dev/$device"
    mount --bind "/dev/$device" "$root/dev/$device"
done
ip link set lo up
exec env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    /usr/bin/unshare --root="$root" --wd="$folder" --setgid "$group" --setuid "$user" "$@"
