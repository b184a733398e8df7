# shellcheck shell=bash disable=SC2034,SC2154 # variables of with-vcan, which sources this
# A guest of with-vcan in User-Mode Linux, with the preload where it is wanted.

prepare_uml() { # the preload is compiled before, as its time is not the guest's
    modprobe=$dir/modprobe variables=("MODPROBE_OPTIONS='-d $dir'")
    # shellcheck disable=SC2016 # the guest expands
    open_lines='out=/dev/ttyS0 err=/dev/ttyS1
    stty -F $out raw -echo; stty -F $err raw -echo'
    mkdir "$dir/lib" && ln -s /usr/lib/uml/modules "$dir/lib/modules"
    printf '#!/bin/sh\nexec modprobe -d %q "$@"\n' "$dir" >"$modprobe"
    chmod +x "$modprobe"
    preload=''
    [[ $way == uml ]] || preload=$(compiled_preload) || exit "$FAILED"
}

compiled_preload() { # compiled once for this user
    local source=${self%/*}/guests/xstate.c folder library
    folder=$(own_folder) && [[ $folder != *[:\ ]* ]] || folder=$dir # LD_PRELOAD is cut at these
    library=$folder/xstate-$(sha256sum <"$source" | cut -c 1-16).so
    [[ -O $library ]] || {
        PATH=$SYSTEM_PATH cc -shared -fPIC -O2 -o "$library.$$" "$source" >&2 &&
            mv "$library.$$" "$library"
    } || die "the preload cannot be compiled: $source"
    echo "$library"
}

start_uml() {
    # Without TMPDIR its memory is in /dev/shm. The two initcalls left out only cost time.
    pump
    ulimit -c 0
    env -i PATH="$SYSTEM_PATH" HOME="$dir" ${preload:+LD_PRELOAD="$preload"} setsid "$UML" \
        mem="$memory" uml_dir="$dir" umid=guest \
        initcall_blacklist=raid6_select_algo,init_zswap \
        root=/dev/root rootfstype=hostfs rootflags=/ rw init="$dir/init" \
        con=null con0=null,fd:1 ssl=null ssl0=null,fd:3 ssl1=null,fd:4 \
        </dev/null >"$dir/log" 2>&1 3>"$dir/out" 4>"$dir/err" &
    begun
}
