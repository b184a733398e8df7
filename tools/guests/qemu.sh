# shellcheck shell=bash disable=SC2034,SC2154 # variables of with-vcan, which sources this
# A guest of with-vcan in QEMU: Debian's kernel, this machine's files by 9p.

readonly ROOT_MODULES=(virtio_pci 9pnet_virtio 9p)

guest_kernel() { # the version of the newest kernel in /boot that can be read and has CAN
    local image version newest=''
    for image in $(printf '%s\n' /boot/vmlinuz-* | sort -V); do
        version=${image#/boot/vmlinuz-}
        [[ ! -r $image || ! -e /lib/modules/$version/kernel/drivers/net/can ]] || newest=$version
    done
    [[ -n $newest ]] && echo "$newest"
}

prepare_qemu() { # its first root brings what is needed to mount the real one
    kernel=$(guest_kernel)
    variables=(TMPDIR=/dev/shm) # 9p lets nobody bind a Unix socket to a file of this machine
    [[ $way == kvm ]] || variables+=(WITH_VCAN_SLOWDOWN=20)
    # shellcheck disable=SC2016 # the guest expands
    open_lines='modprobe virtio_console
    for _ in {1..100}; do
        out=(/dev/vport*p1) err=(/dev/vport*p2)
        [[ -e $out && -e $err ]] && break
        sleep 0.1
    done'
    local root=$dir/root order=0 module
    mkdir -p "$root"/{bin,dev,modules,mnt}
    cp "$(found busybox)" "$root/bin/busybox"
    for module in $(PATH=$SYSTEM_PATH modprobe -S "$kernel" --show-depends -a "${ROOT_MODULES[@]}" |
        awk '$1 == "insmod" && !seen[$2]++ { print $2 }'); do
        case $module in
            *.xz) xz -dc "$module" ;;
            *.zst) zstd -dc "$module" ;;
            *) cat "$module" ;;
        esac >"$root/modules/$((order += 1)).ko"
    done
    cat >"$root/init" <<END
#!/bin/busybox sh
for number in \$(/bin/busybox seq $order); do /bin/busybox insmod /modules/\$number.ko; done
/bin/busybox mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144,cache=loose host /mnt
/bin/busybox mount -t devtmpfs devtmpfs /mnt/dev
exec /bin/busybox switch_root /mnt $dir/init
END
    chmod +x "$root/init"
    (cd "$root" && find . | ./bin/busybox cpio -o -H newc 2>/dev/null) >"$dir/initrd"
}

start_kvm() { start_qemu -accel kvm -cpu host; }
prepare_kvm() { prepare_qemu; }

start_qemu() {
    (($#)) || set -- -accel tcg -cpu max
    pump
    ulimit -c 0
    env -i PATH="$SYSTEM_PATH" HOME="$dir" setsid "$QEMU" "$@" -m "$memory" \
        -nodefaults -no-user-config -display none -no-reboot \
        -kernel "/boot/vmlinuz-$kernel" -initrd "$dir/initrd" \
        -append "console=ttyS0 panic=-1 mitigations=off random.trust_cpu=on" \
        -serial "file:$dir/log" \
        -fsdev local,id=host,path=/,security_model=none,multidevs=remap \
        -device virtio-9p-pci,fsdev=host,mount_tag=host \
        -device virtio-serial-pci \
        -chardev "file,id=out,path=$dir/out" -device virtserialport,chardev=out,nr=1 \
        -chardev "file,id=err,path=$dir/err" -device virtserialport,chardev=err,nr=2 \
        </dev/null >"$dir/log.qemu" 2>&1 &
    begun
}
