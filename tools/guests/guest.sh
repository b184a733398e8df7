# shellcheck shell=bash disable=SC2034,SC2154 # variables of with-vcan, which sources this
# What all guests of with-vcan have in common: what they lack, a probe, their init, their end.

readonly UML=${WITH_VCAN_UML:-linux.uml} QEMU=${WITH_VCAN_QEMU:-qemu-system-x86_64}
declare -rA PROBE_S=([uml]=10 [uml-preload]=10 [kvm]=10 [qemu]=60)
declare -rA PACKAGE_OF=(
    [$QEMU]=qemu-system-x86 [$UML]=user-mode-linux [modprobe]=kmod [ip]=iproute2 [mount]=mount
    [busybox]=busybox-static [cc]="gcc libc6-dev"
)
declare -rA PROGRAMS_OF=(
    [uml]="$UML modprobe ip mount" [uml-preload]="$UML modprobe ip mount cc"
    [kvm]="$QEMU modprobe ip mount busybox" [qemu]="$QEMU modprobe ip mount busybox"
)

way='' dir='' guest='' pumps=() command_pid='' probe_pid=''

lacks() { # say what a way lacks; false if it lacks nothing
    local program packages=()
    for program in ${PROGRAMS_OF[$1]}; do
        found "$program" >/dev/null || packages+=("${PACKAGE_OF[$program]}")
    done
    case $1 in
        kvm | qemu) guest_kernel >/dev/null || packages+=(linux-image-amd64) ;;&
        kvm) [[ -w /dev/kvm ]] || { echo "/dev/kvm cannot be opened"; return; } ;;
        uml-preload) [[ $(uname -m) == x86_64 ]] || { echo "it is for x86_64"; return; } ;;
    esac
    ((${#packages[@]})) && echo "apt-get install ${packages[*]}"
}

found() { PATH=$SYSTEM_PATH type -P "$1"; }

# --- probes ----------------------------------------------------------------------------
patience() { # seconds for `true` in the guest of a way: more where others want the processors
    local load
    read -r load _ </proc/loadavg
    echo $((PROBE_S[$1] * (1 + ${load%.*} / $(nproc))))
}

works() { # run `true` in the guest of a way
    local limit_s
    limit_s=$(patience "$1")
    WITH_VCAN_PROBE=1 timeout --foreground -k 5 "$limit_s" \
        "$self" --way "$1" --timeout "$limit_s" true >/dev/null 2>&1 &
    probe_pid=$!
    wait "$probe_pid"
}

own_folder() { # a folder for what outlives this run, which nobody else can write to
    local folder=${XDG_CACHE_HOME:-}
    [[ $folder == /* ]] || folder=${HOME:-/nonexistent}/.cache
    folder+=/with-vcan
    (umask 077 && mkdir -p "$folder") 2>/dev/null
    [[ -d $folder && ! -L $folder && -O $folder && -w $folder ]] || return
    (((8#$(stat -c %a "$folder") & 8#022) == 0)) && echo "$folder"
}

programs() { # which machine, since when, with which programs
    local program paths=("$self")
    for program in "${!PACKAGE_OF[@]}"; do paths+=("$(found "$program")"); done
    cat /proc/sys/kernel/random/boot_id
    stat -L -c '%n %s %Y' "${paths[@]}" "$(guest_kernel)" 2>/dev/null
}

remembered() { # the way that worked before
    local folder line
    folder=$(own_folder) && read -r line <"$folder/way" && [[ $line == "$(programs | cksum)"* ]] &&
        echo "${line##* }"
} 2>/dev/null

remember() {
    local folder
    folder=$(own_folder) && echo "$(programs | cksum) $1" >"$folder/way.$$" &&
        mv "$folder/way.$$" "$folder/way"
} 2>/dev/null

forget() {
    local folder
    folder=$(own_folder) && rm -f "$folder/way"
}

# --- its files -------------------------------------------------------------------------
write_guest_files() { # what differs between guests is in $modprobe, $variables, $open_lines
    local modprobe=modprobe variables=() open_lines
    "prepare_${way%-preload}"
    {
        export -p
        printf 'export %s\n' "${variables[@]}"
        printf 'umask %s\ncd %q && exec' "$(umask)" "$PWD"
        printf ' %q' "$@"
        echo
    } >"$dir/command"
    cat >"$dir/init" <<END
#!/bin/bash
export PATH=$SYSTEM_PATH
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mkdir /dev/pts /dev/shm
mount -t devpts -o ptmxmode=0666 devpts /dev/pts
mount -t tmpfs tmpfs /dev/shm
ln -s /proc/self/fd /dev/fd
ln -s fd/0 /dev/stdin; ln -s fd/1 /dev/stdout; ln -s fd/2 /dev/stderr
echo '${HOSTNAME:-guest}' >/proc/sys/kernel/hostname
[[ $modprobe == modprobe ]] ||
    echo $modprobe >/proc/sys/kernel/modprobe   # the kernel loads what is used
ip link set lo up
$(declare -f as_root add_bus)
mtu=$mtu
for bus in ${buses[*]}; do add_bus \${bus/,/ } || echo \$bus >>$dir/no_bus; done
if ((multicast = $multicast)); then
    $modprobe ipv6
    ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo &&
        ip route add local ff00::/8 dev lo table local || echo multicast on lo >>$dir/no_bus
fi
echo >$dir/begun
if [[ ! -e $dir/no_bus ]]; then
    # The lines lead outside, but COMMAND gets pipes: it must not take them for a terminal.
    $open_lines
    mkfifo /dev/out /dev/err
    cat /dev/out >\$out & pumps=\$!
    cat /dev/err >\$err & pumps+=" \$!"
    env -i timeout -k 5 $seconds bash $dir/command </dev/null >/dev/out 2>/dev/err
    echo \$? >$dir/status
fi
for pid in /proc/[0-9]*; do       # what COMMAND left running would keep the pipes open
    pid=\${pid#/proc/}
    [[ " 1 \$pumps " == *" \$pid "* ]] || kill -KILL \$pid 2>/dev/null
done
wait \$pumps
sync
echo o >/proc/sysrq-trigger
sleep 60
END
    chmod +x "$dir/init"
    mkfifo "$dir/out" "$dir/err"
}

# --- its run ---------------------------------------------------------------------------
pump() { # the lines that lead outside are pipes of ours: what a guest is given may get non-blocking
    tee -p /dev/null <"$dir/out" & pumps+=($!)
    tee -p /dev/null <"$dir/err" >&2 & pumps+=($!)
}

begun() { # its processes are one group; bash is not to report their end
    guest=$!
    disown "$guest"
}

end_guest() { # one that outlived the guest's kernel would go on, untraced, on this machine
    [[ -n $guest ]] || return
    kill -KILL -- "-$guest" "$guest"
    for _ in {1..100}; do kill -0 "$guest" || break; sleep 0.02; done
} 2>/dev/null

wait_for_guest() {
    # The guest keeps COMMAND's time; these are for a guest that hangs, or never begins.
    local ticks begins_s failed="did not finish"
    begins_s=$(($(patience "$way") + 20))
    for ((ticks = 0; ticks < (seconds + 60) * 10; ticks++)); do
        kill -0 "$guest" 2>/dev/null || break
        if ((ticks >= begins_s * 10)) && [[ ! -e $dir/begun ]]; then
            failed="did not begin within $begins_s s"
            break
        fi
        sleep 0.1
    done
    end_guest
    [[ ! -s $dir/no_bus ]] || die "the guest cannot make $(tr '\n' ' ' <"$dir/no_bus")"
    [[ -s $dir/status ]] || {
        [[ -n $only ]] || forget
        cat "$dir"/log* | tail -n 20 >&2
        die "the guest $failed; above is the end of what its kernel said"
    }
    wait "${pumps[@]}"
}

clean_up() {
    {
        [[ -z $probe_pid ]] || { kill "$probe_pid" && wait "$probe_pid"; }
        end_guest
        ((${#pumps[@]} == 0)) || kill "${pumps[@]}"
        [[ -z $command_pid ]] || kill "$command_pid"
        [[ -z $dir ]] || rm -rf "$dir"
    } 2>/dev/null
    give_back
}
