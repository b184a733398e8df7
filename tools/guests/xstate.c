/*
 * Let User-Mode Linux 6.1 run where the extended state of the processor is larger than it knows.
 *
 * It keeps 2696 bytes of that state for each of its processes. With AMX there are about 11000,
 * and the host's kernel takes the state of a traced process as a whole or not at all
 * (PTRACE_SETREGSET, NT_X86_XSTATE: EFAULT). So for each of its calls the whole state is read:
 * reading hands out its beginning, writing lays what came over its beginning and writes all of
 * it back. The rest belongs to features that processes ask the kernel for; none in a guest can.
 *
 * with-vcan compiles it: cc -shared -fPIC -O2 -o xstate.so xstate.c, and sets LD_PRELOAD.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

typedef long trace_call(int request, pid_t pid, void *address, void *data);

static trace_call *next;
static char whole[1 << 16]; /* a stack of User-Mode Linux is smaller; one thread of it traces */

__attribute__((constructor)) static void find_next(void)
{
    next = (trace_call *)dlsym(RTLD_NEXT, "ptrace");
}

static long trace_state(int request, pid_t pid, struct iovec *part)
{
    struct iovec all = {whole, sizeof whole};

    if (next(PTRACE_GETREGSET, pid, (void *)NT_X86_XSTATE, &all) < 0)
        return -1;
    if (all.iov_len == sizeof whole) {
        errno = E2BIG;
        return -1;
    }
    if (part->iov_len > all.iov_len)
        part->iov_len = all.iov_len;
    if (request == PTRACE_GETREGSET) {
        memcpy(part->iov_base, whole, part->iov_len);
        return 0;
    }
    memcpy(whole, part->iov_base, part->iov_len);
    return next(PTRACE_SETREGSET, pid, (void *)NT_X86_XSTATE, &all);
}

long ptrace(enum __ptrace_request request, ...)
{
    va_list rest;

    va_start(rest, request);
    pid_t pid = va_arg(rest, pid_t);
    void *address = va_arg(rest, void *), *data = va_arg(rest, void *);
    va_end(rest);
    if ((request == PTRACE_GETREGSET || request == PTRACE_SETREGSET) && address == (void *)NT_X86_XSTATE)
        return trace_state(request, pid, data);
    return next(request, pid, address, data);
}
