/*
 * For tests of tools/with-vcan: make ptrace say what it says on a processor with AMX.
 *
 * The extended state of a traced process then has 11008 bytes. A reader with less room gets the
 * beginning; a writer with less gets EFAULT (seen on Linux 6.18 with one word less than all).
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

enum { SIZE = 11008 };

typedef long trace_call(int request, pid_t pid, void *address, void *data);

static char state[1 << 16];

static long trace_state(trace_call *real, int request, pid_t pid, struct iovec *part)
{
    struct iovec known = {state, sizeof state};

    if (part->iov_len > SIZE)
        part->iov_len = SIZE;
    if (request == PTRACE_SETREGSET && part->iov_len != SIZE) {
        errno = EFAULT;
        return -1;
    }
    if (real(PTRACE_GETREGSET, pid, (void *)NT_X86_XSTATE, &known) < 0)
        return -1;
    if (request == PTRACE_GETREGSET) {
        memcpy(part->iov_base, state, part->iov_len);
        return 0;
    }
    memcpy(state, part->iov_base, known.iov_len);
    return real(PTRACE_SETREGSET, pid, (void *)NT_X86_XSTATE, &known);
}

long ptrace(enum __ptrace_request request, ...)
{
    trace_call *real = (trace_call *)dlsym(RTLD_NEXT, "ptrace");
    va_list rest;

    va_start(rest, request);
    pid_t pid = va_arg(rest, pid_t);
    void *address = va_arg(rest, void *), *data = va_arg(rest, void *);
    va_end(rest);
    if ((request == PTRACE_GETREGSET || request == PTRACE_SETREGSET) && address == (void *)NT_X86_XSTATE)
        return trace_state(real, request, pid, data);
    return real(request, pid, address, data);
}
