# Boots systemd over a copy of this machine that is thrown away, in namespaces of its own, with a cell installed as
# docs/how-to/deployment.md says. Called as `systemd.sh BINARY FOLDER`: FOLDER has cell/, keys/members/ and units/.
set -e
binary=$1 folder=$2
mount --make-rprivate /
# Outside of the machine's own mounts, so that the copy does not have itself in it.
mount -t tmpfs tmpfs "$folder/machine"
cd "$folder/machine"
mkdir upper work root
mount -t overlay overlay -o lowerdir=/,upperdir="$PWD/upper",workdir="$PWD/work" root
root=$PWD/root
mount -t proc proc "$root/proc"
mount -t sysfs -o ro sysfs "$root/sys"
mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"
mount -t tmpfs -o mode=755 tmpfs "$root/dev"
for device in null zero full random urandom tty; do
    : > "$root/dev/$device"
    mount --bind "/dev/$device" "$root/dev/$device"
done
mkdir "$root/dev/shm" "$root/dev/pts"
mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
ln -s pts/ptmx "$root/dev/ptmx"
mount -t tmpfs -o mode=755 tmpfs "$root/run"
for place in dev/shm tmp; do
    mount -t tmpfs tmpfs "$root/$place"
done
# What the machine starts by itself is not started here.
for wants in sysinit multi-user network-online timers local-fs; do
    place="$root/lib/systemd/system/$wants.target.wants"
    [ ! -d "$place" ] || mount -t tmpfs tmpfs "$place"
done
rm -rf "$root/etc/systemd/system"
mkdir -p "$root/etc/systemd/system" "$root/usr/local/bin" "$root/etc/understudy"
ip link set lo up

chroot "$root" userdel understudy 2> /dev/null || :
chroot "$root" useradd --system --shell /usr/sbin/nologin understudy
: > "$root/usr/local/bin/understudy-runtime"
mount --bind "$binary" "$root/usr/local/bin/understudy-runtime"
cp "$folder"/cell/* "$root/etc/understudy/"
chmod -R a+rX "$root/etc/understudy"
chroot "$root" install -d -m 700 -o understudy -g understudy /var/lib/understudy/keys /var/log/understudy
cp -r "$folder"/keys/members/* "$root/var/lib/understudy/keys/"
chroot "$root" chown -R understudy:understudy /var/lib/understudy
install -m 644 "$folder"/units/*.service "$root/etc/systemd/system/"

mkdir "$root/run/before"
cd "$root"
pivot_root . run/before
umount -l /run/before
exec env -i container=unshare PATH=/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    /lib/systemd/systemd --system --unit=multi-user.target --log-target=null --show-status=false
